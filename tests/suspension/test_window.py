"""The window between particles and grid has the transform that it is divided out by."""

import numpy as np
import pytest

from dustfall.suspension.window import (
    window,
    window_polynomials,
    window_steepness,
    window_transform,
)


@pytest.mark.parametrize("points", [4, 8, 12])
def test_the_transform_is_the_integral_of_the_window(points):
    steepness = window_steepness(points, 1.3)
    node, weight = np.polynomial.legendre.leggauss(80)
    z = node * points / 2
    for angle in (0.0, 1.0, 3.0, 6.0, 9.0):
        integral = weight * points / 2 @ (window(z, points, steepness) * np.cos(angle * z))
        assert window_transform(angle, points, steepness) == pytest.approx(integral, abs=1e-13)


@pytest.mark.parametrize("points", [4, 8, 12])
def test_polynomials_follow_the_window_closer_than_its_own_error(points):
    steepness = window_steepness(points, 1.3)
    t = np.linspace(-1, 1, 201)
    z = np.arange(points)[:, None] - points / 2 + (t + 1) / 2
    values = np.array([np.polyval(c, t) for c in window_polynomials(points, steepness).T])
    assert np.abs(values - window(z, points, steepness)).max() < 0.1 * np.exp(-steepness)
