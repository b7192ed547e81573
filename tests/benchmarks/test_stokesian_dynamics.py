"""Stokesian dynamics as a peer: exact for the pairs that it corrects, and far away."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dustfall.benchmarks.stokesian_dynamics import _mobility, stokesian_dynamics
from dustfall.stokes.references.fundamental_solutions import reference_loads
from dustfall.stokes.references.moving_pairs import loads_on_two_spheres

THREE = np.array([[0.0, 0.0, 0.0], [1.2, 0.3, 2.0], [-1.0, 0.8, 0.9]])


@pytest.mark.parametrize(
    ("gap", "error"), [(0.003, 1e-5), (0.05, 1e-5), (0.5, 1e-5), (5.0, 1e-5), (30.0, 1e-8)]
)
def test_a_pair_feels_the_exact_forces(gap, error):
    motions = np.random.default_rng(1).normal(size=(2, 2, 3))
    centres = np.array([np.zeros(3), (1.0 + gap) * np.array([2.0, 3.0, 6.0]) / 7.0])
    exact = loads_on_two_spheres(centres, *motions).force
    found = stokesian_dynamics(centres, *motions)
    np.testing.assert_allclose(found, exact, atol=error * np.abs(exact).max())


def test_the_mobility_is_symmetric_and_positive():
    mobility = _mobility(THREE)
    np.testing.assert_allclose(mobility, mobility.T, atol=1e-15)
    assert np.linalg.eigvalsh(mobility).min() > 0.0


def test_three_spheres_feel_about_what_the_independent_reference_says():
    motions = np.random.default_rng(2).normal(size=(2, 3, 3))
    exact = reference_loads(THREE, *motions, tolerance=1e-5).force
    found = stokesian_dynamics(THREE, *motions)
    assert 1e-6 < np.abs(found - exact).max() / np.abs(exact).max() < 0.02


def test_forces_turn_with_the_scene():
    motions = np.random.default_rng(3).normal(size=(2, 3, 3))
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    found = stokesian_dynamics(THREE, *motions)
    turned = stokesian_dynamics(THREE @ turn.T, *(motions @ turn.T))
    np.testing.assert_allclose(turned, found @ turn.T, atol=1e-12)
