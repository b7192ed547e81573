"""A fluid that flows back between nearest neighbours: the mean is another, and nothing else."""

import numpy as np
import pytest

from dustfall.forces.formulas import FORMULAS
from dustfall.sedimentation import BackFlow, NearestNeighbours, random_start, start_from, step
from dustfall.sedimentation.closures.back_flow import random_mean

STOKES_NUMBER = 9.0


def settled(closure, start, steps=20):
    for _ in range(steps):
        start = step(start, closure, 0.1, STOKES_NUMBER)
    return start


def test_seen_from_the_rising_fluid_the_cloud_is_that_of_nearest_neighbours():
    model, start = FORMULAS["stokeslets"], random_start(200, 1e-3, seed=1)
    closure = BackFlow(model, 1e-3)
    rising = np.array([0.0, 0.0, closure.velocity])
    seen = start_from(start.position, 1e-3, start.velocity - rising)
    here, there = settled(closure, start), settled(NearestNeighbours(model), seen)
    np.testing.assert_allclose(here.velocity - rising, there.velocity, atol=1e-12)
    way = STOKES_NUMBER * 2.0 * rising
    np.testing.assert_allclose(here.position - way, there.position, atol=1e-10)


def test_alone_a_sphere_settles_with_batchelors_mean():
    closure = BackFlow(FORMULAS["isolated"], 1e-3)
    assert closure.velocity == pytest.approx(6.55e-3, rel=1e-12)
    last = settled(closure, random_start(10, 1e-3, seed=1), steps=300)
    np.testing.assert_allclose(last.velocity[:, 2], -(1 - 6.55e-3), rtol=1e-10)


@pytest.mark.parametrize(("phi", "mean", "within"), [(1e-4, 1.204, 0.003), (1e-5, 1.094, 0.002)])
def test_the_mean_over_random_surroundings_is_that_of_points_drawn_one_scene_at_a_time(
    phi, mean, within
):
    # From 3,000 scenes of five points at random, each drawn by itself; two standard errors.
    assert random_mean(FORMULAS["rotne_prager"], phi, 5) == pytest.approx(mean, abs=within)


def test_files_tell_it_from_nearest_neighbours():
    settings = BackFlow(FORMULAS["isolated"], 1e-3).settings()
    assert (settings["model"], settings["force_model"]) == ("back_flow", "isolated")
    assert settings["back_flow"] == pytest.approx(6.55e-3)
    with pytest.raises(ValueError, match=r"phi is 0\.9:"):
        BackFlow(FORMULAS["isolated"], 0.9)
