"""Neighbours at their own velocities: as the paper's closure where all move as one, and beyond."""

import numpy as np
import pytest

from dustfall.forces.formula import load_formula
from dustfall.sedimentation import (
    MovingNeighbours,
    NearestNeighbours,
    Properties,
    random_start,
    start_from,
    step,
)
from dustfall.sedimentation.closures.moving_neighbours import resistance_of_clusters
from dustfall.stokes.references.moving_pairs import pair_resistance
from dustfall.suspension.rotne_prager import free_mobility

DUST = Properties()


def test_neighbours_that_move_as_one_are_those_of_the_papers_closure():
    state = random_start(200, 1e-3, seed=2, velocity="stokes")
    together = NearestNeighbours(load_formula("rotne_prager"))(state).on(state.velocity)
    closure = MovingNeighbours(DUST, 0.1)
    own = NearestNeighbours.__call__(closure, state)  # without the near field
    np.testing.assert_allclose(own.on(state.velocity), together, atol=1e-10)


def test_a_cluster_that_moves_feels_the_inverse_of_its_mobility():
    rng = np.random.default_rng(1)
    centres = np.vstack([np.zeros((1, 3)), 3.0 * rng.normal(size=(5, 3))])
    velocity = rng.normal(size=(6, 3))
    beta, force = resistance_of_clusters(centres[None, 1:], velocity[None])
    whole = -np.linalg.solve(free_mobility(centres), velocity.ravel()).reshape(6, 3)
    np.testing.assert_allclose(force[0] - beta[0] * velocity[0], whole[0], atol=1e-12)


def pair(gap, velocity):
    """Two spheres along x, fifty more far away and at rest."""
    far = np.array([[x, y, 60.0] for x in range(10, 100, 20) for y in range(10, 100, 10)], float)
    position = np.vstack([[[49.5 - 0.5 * gap, 49.0, 10.0], [50.5 + 0.5 * gap, 49.0, 10.0]], far])
    moving = np.vstack([velocity, np.zeros_like(far)])
    phi = len(position) * np.pi / 6.0 / 100.0**3
    return start_from(position, phi, moving)


@pytest.mark.parametrize("gap", [0.05, 0.3])
def test_two_that_approach_each_other_feel_lubrication(gap):
    """Against the exact resistance, for slow spheres and a step in which nothing else happens."""
    size = 1e-4
    state = pair(gap, np.array([[1e-3, 0.0, 0.0], [-1e-3, 0.0, 0.0]]))
    drag = MovingNeighbours(DUST, size)(state).force[0, 0]
    along = pair_resistance(gap).along
    assert drag == pytest.approx(-1e-3 * (along[0, 0] - along[0, 2]), rel=2e-3)


def test_two_that_would_touch_are_stopped():
    state = pair(1.2, np.array([[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]]))
    closure = MovingNeighbours(DUST, 0.1)
    after = step(state, closure, 0.1, DUST.stokes_number)
    for _ in range(5):
        after = step(after, closure, 0.1, DUST.stokes_number)
    assert np.linalg.norm(after.position[0] - after.position[1]) > 1.0
    assert closure.statistics(after, after.last_drag)["overlaps"] == 0


def test_threads_change_no_bit():
    state = random_start(300, 1e-2, seed=3)
    one, two = (
        step(state, MovingNeighbours(DUST, 0.1, threads=t), 0.1, DUST.stokes_number) for t in (1, 2)
    )
    np.testing.assert_array_equal(one.velocity, two.velocity)


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan])
def test_steps_that_mean_nothing_are_refused(size):
    with pytest.raises(ValueError, match="positive and finite"):
        MovingNeighbours(DUST, size)
