"""The cost of a prediction, on a clock of our own."""

import time

import numpy as np
import pytest

from dustfall.benchmarks.cost import prediction_cost


def test_cost_is_the_least_time_a_scene_and_leaves_out_the_first_call(monkeypatch):
    clock = 0.0
    durations = iter([50.0, 7e-3, 4e-3, 5e-3])

    class Model:
        def predict(self, neighbours):
            nonlocal clock
            clock += next(durations)

    monkeypatch.setattr(time, "process_time", lambda: clock)
    assert prediction_cost(Model(), np.ones((1000, 5, 3)), repetitions=3) == pytest.approx(4.0)
