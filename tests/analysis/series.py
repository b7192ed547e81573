"""Series of known statistics for the tests of what is made of them."""

import numpy as np
from scipy import signal


def autoregressive(rng, m, memory):
    """A stationary first-order autoregressive series of unit variance."""
    a = np.exp(-1 / memory)
    noise = np.sqrt(1 - a**2) * rng.normal(size=m)
    return signal.lfilter([1], [1, -a], noise, zi=[a * rng.normal()])[0]
