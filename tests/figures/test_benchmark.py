"""The figure of the benchmark marks what no other method beats."""

import numpy as np
import pandas as pd
import pytest

from dustfall.figures.benchmark import front, solver_benchmark


def test_front_holds_the_points_that_nothing_beats():
    milliseconds = [1.0, 2.0, 3.0, 3.0, 0.5]
    error = [1e-3, 1e-2, 1e-6, 1e-5, 1e-1]
    np.testing.assert_array_equal(front(milliseconds, error), [True, False, True, False, True])


def test_each_set_has_a_panel_with_every_method():
    frame = pd.DataFrame(
        {
            "set": ["one", "one", "two", "two"],
            "method": ["a", "b"] * 2,
            "setting": "",
            "milliseconds": [1.0, 2.0, 3.0, 4.0],
            "error_95": [1e-3, 1e-4, 1e-5, 1e-6],
        }
    )
    panels = [ax for ax in solver_benchmark(frame).axes if ax.get_visible()]
    assert [panel.get_title("right") for panel in panels] == ["one", "two"]
    for panel in panels:
        labels = [line.get_label() for line in panel.lines]
        assert {"a", "b"} <= set(labels)
    with pytest.raises(ValueError, match="lacks the column"):
        solver_benchmark(frame.drop(columns="error_95"))
