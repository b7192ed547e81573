"""Rigid multiblobs: a peer that converges to the exact force as its blobs get finer."""

import numpy as np
import pytest

from dustfall.stokes.references.exact_pairs import forces_on_two_spheres
from dustfall.stokes.references.multiblob import multiblob_forces, shell

FLOW = np.array([0.36, 0.8, 0.48])


@pytest.mark.parametrize(("subdivisions", "blobs"), [(0, 12), (1, 42), (2, 162)])
def test_shell_is_even_and_centred(subdivisions, blobs):
    points = shell(subdivisions)
    assert points.shape == (blobs, 3)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(points.T @ points, blobs / 3.0 * np.eye(3), atol=1e-12 * blobs)


@pytest.mark.parametrize("subdivisions", [0, 1, 2])
def test_lone_sphere_feels_stokes_drag_from_any_side(subdivisions):
    force = multiblob_forces(np.zeros((1, 3)), subdivisions, FLOW)
    np.testing.assert_allclose(force, [24.0 * FLOW], rtol=1e-9)


def test_finer_shells_come_nearer_to_two_exact_spheres():
    centres = [[0.0, 0.0, 0.0], [0.3, -0.2, 1.2]]
    exact = forces_on_two_spheres(centres, FLOW)
    errors = [np.abs(multiblob_forces(centres, k, FLOW) - exact).max() / 24.0 for k in range(3)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 5e-4
