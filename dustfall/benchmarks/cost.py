"""What a prediction of a force model costs."""

import time

import numpy as np


def prediction_cost(model, neighbours: np.ndarray, repetitions: int = 5) -> float:
    """Processor time of a prediction [microseconds a scene], the least of some repetitions.

    `model` has `predict`; `neighbours` (m, 5, 3) [d_p]. A first call, which compiles, is not timed.
    """
    model.predict(neighbours[:1])
    least = np.inf
    for _ in range(repetitions):
        start = time.process_time()
        model.predict(neighbours)
        least = min(least, time.process_time() - start)
    return 1e6 * least / len(neighbours)
