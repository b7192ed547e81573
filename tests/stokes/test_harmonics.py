"""Harmonics: orthonormal, turned as fields turn, and the single layer's spectrum on a sphere."""

import numpy as np
import pytest
from scipy.integrate import lebedev_rule

from dustfall.stokes.harmonics import (
    axes_swapped,
    exact_response,
    real_harmonics,
    response_matrix,
    total_momentum_projectors,
)

POINTS, WEIGHTS = lebedev_rule(29)
POINTS = POINTS.T


def test_harmonics_are_orthonormal():
    values = real_harmonics(14, POINTS)
    np.testing.assert_allclose(values.T @ (WEIGHTS[:, None] * values), np.eye(225), atol=1e-12)


def test_harmonics_have_the_textbook_forms():
    x, y, z = direction = np.array([0.48, -0.6, 0.64])
    values = real_harmonics(2, direction[None])[0]
    c = np.sqrt(3.0 / (4.0 * np.pi))
    np.testing.assert_allclose(values[:4], [0.5 / np.sqrt(np.pi), c * y, c * z, c * x], rtol=1e-13)
    assert values[4] == pytest.approx(np.sqrt(15.0 / (4.0 * np.pi)) * x * y)


@pytest.mark.parametrize("degree", [0, 1, 4, 15, 40])
def test_swapping_axes_twice_changes_nothing(degree):
    swap = axes_swapped(degree)
    assert np.abs(swap @ swap - np.eye((degree + 1) ** 2)).max() < 1e-12
    values, swapped = (real_harmonics(degree, p) for p in (POINTS[:50], POINTS[:50, [0, 2, 1]]))
    np.testing.assert_allclose(values @ swap, swapped, atol=1e-11)


@pytest.mark.parametrize("n", [0, 1, 2, 7])
def test_projectors_split_a_degree_into_subspaces_of_the_right_size(n):
    projectors = total_momentum_projectors(n, axes_swapped(n))
    assert set(projectors) == ({1} if n == 0 else {n - 1, n, n + 1})
    for total, projector in projectors.items():
        assert projector.trace() == pytest.approx(2 * total + 1)
        assert np.abs(projector @ projector - projector).max() < 1e-13
        assert np.abs(projector - projector.T).max() < 1e-13
    assert np.abs(sum(projectors.values()) - np.eye(3 * (2 * n + 1))).max() < 1e-13


STRAIN = np.array([[1.0, 0.3, 0.2], [0.3, -0.4, 0.5], [0.2, 0.5, -0.6]])
SPIN = np.array([0.3, -1.0, 0.5])

# Traction on a unit sphere held in a flow, mu = 1 (Kim and Karrila 1991, chapter 3).
HELD = {
    "translation": (lambda x: np.tile([0.2, 1.0, -0.4], (len(x), 1)), 1.5),
    "rotation": (lambda x: np.cross(SPIN, x), 3.0),
    "straining": (lambda x: x @ STRAIN, 5.0),
}


@pytest.mark.parametrize("flow", HELD)
def test_a_held_sphere_answers_with_the_exact_traction(flow):
    velocity, ratio = HELD[flow]
    incoming = real_harmonics(2, POINTS).T @ (WEIGHTS[:, None] * velocity(POINTS))
    moments = (response_matrix(exact_response(2)) @ incoming.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(moments, ratio * incoming, atol=1e-12)
