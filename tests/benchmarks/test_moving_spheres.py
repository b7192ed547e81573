"""Drag on spheres that move by each of the compared ways, where it is known."""

import numpy as np
import pytest

from dustfall.benchmarks.moving_spheres import (
    among_nearest,
    freely_turning_forces,
    moving_spheres,
    near_field_drag,
    nearest_neighbours_drag,
    rotne_prager_drag,
)
from dustfall.forces import load_model


def pair(gap):
    return np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0 + gap]])


def test_a_pair_that_approaches_or_passes_has_its_exact_drag():
    # Brenner 1961 along the line, Kim and Karrila 1991 across it, free to turn; gaps of 0.5 d_p.
    for axis, expected in {2: 2.038655, 0: 1.37048}.items():
        velocity = np.zeros((2, 3))
        velocity[:, axis] = 1.0, -1.0
        force, estimate, met = freely_turning_forces(pair(0.5), velocity, 1e-4)
        assert met
        assert estimate < 1e-3
        np.testing.assert_allclose(force, -expected * velocity, atol=3e-4)
        np.testing.assert_allclose(near_field_drag(pair(0.5), velocity), force, atol=1e-3)


def test_far_apart_all_ways_agree():
    centres = 200.0 * np.arange(8.0)[:, None] * np.array([0.0, 0.6, 0.8])
    velocity = np.random.default_rng(1).normal(size=(8, 3))
    truth, _, _ = freely_turning_forces(centres, velocity, 1e-3)
    for found in (
        rotne_prager_drag(centres, velocity),
        near_field_drag(centres, velocity),
    ):
        np.testing.assert_allclose(found, truth, atol=2e-3)
    # It takes all neighbours to move as the sphere does, and is off by their Stokeslets.
    closure = nearest_neighbours_drag(load_model(), centres, velocity)
    np.testing.assert_allclose(closure, truth, atol=0.03)


def test_among_five_neighbours_the_drag_is_that_of_six_spheres_and_forgets_the_others():
    rng = np.random.default_rng(3)
    centres = 3.0 * rng.normal(size=(6, 3))
    velocity = rng.normal(size=(6, 3))
    six = rotne_prager_drag(centres, velocity)
    np.testing.assert_allclose(among_nearest(rotne_prager_drag, centres, velocity), six, rtol=1e-9)
    crowd = np.vstack([centres, centres + 50.0])
    own = among_nearest(rotne_prager_drag, crowd, np.tile(velocity, (2, 1)))
    np.testing.assert_allclose(own, np.tile(six, (2, 1)), rtol=1e-9)


def test_the_near_field_brings_the_drag_of_a_crowded_cloud_closer_to_the_truth():
    table = moving_spheres([0.05], particles=12, tolerance=1e-2).set_index("method")
    assert table["converged"].all()
    error = table["error"]
    assert error["all, Rotne-Prager and near field"] < 0.5 * error["all, Rotne-Prager"]
    five, moving, exact = error.filter(like="five")
    assert error["all, Rotne-Prager"] < five
    # The six-sphere formula of moving neighbours errs by far less than that they are five.
    assert moving == pytest.approx(exact, rel=0.1)
    assert moving > error["all, Rotne-Prager and near field"]
    assert (table["largest"] >= table["error"]).all()


def test_particles_that_fit_nowhere_are_refused():
    with pytest.raises(ValueError, match="volume fraction"):
        moving_spheres([0.6], particles=12)
