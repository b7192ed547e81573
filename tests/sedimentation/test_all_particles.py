"""All particles settle together as exact solutions and conservation laws say."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dustfall.sedimentation.closures import AllParticles
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import Checkpoint, Output, Schedule, settle
from dustfall.sedimentation.start import random_start, start_from
from dustfall.sedimentation.state import State, move, step
from dustfall.suspension.conjugate_gradients import conjugate_gradients
from dustfall.suspension.periodic import periodic_mobility
from dustfall.units import RADIUS, SPHERE_VOLUME

DUST = Properties()
STOKES = DUST.stokes_number
STEP = 0.1


def taken(state, closure, steps, size=STEP):
    for _ in range(steps):
        state = step(state, closure, size, closure.stokes_number)
    return state


def in_cube(positions, side, velocity="stokes"):
    phi = len(positions) * SPHERE_VOLUME / side**3
    return start_from(positions, phi, velocity)


def basset_velocity(time, steps, viscosity):
    """Velocity of a lone sphere that is let go at rest, with Basset's history force, unbounded.

    dv/dt = -1 - v - a / sqrt(pi nu) int v'(s) / sqrt(t - s) ds, v' constant over each step, as
    these units have it; added mass is left out, as in the closure.
    """
    size = time / steps
    edge = np.sqrt(np.arange(steps + 1) * size)
    kernel = 2 * RADIUS / np.sqrt(np.pi * viscosity) * np.diff(edge)
    velocity, acceleration = 0.0, np.zeros(steps)
    for i in range(steps):
        history = acceleration[:i][::-1] @ kernel[1 : i + 1]
        acceleration[i] = (-1 - velocity - history) / (1 + size / 2 + kernel[0])
        velocity += size * acceleration[i]
    return velocity


def test_a_lone_sphere_feels_the_history_of_its_motion_as_basset_found():
    closure = AllParticles(DUST, 0.05, shortest_memory=0.004)
    start = in_cube(np.zeros((1, 3)), 90.0, "rest")
    end = taken(start, closure, 20, 0.05)
    expected = basset_velocity(1.0, 1000, closure.viscosity)
    without = np.exp(-1.0) - 1
    assert abs(expected - without) > 0.015
    assert end.velocity[0, 2] == pytest.approx(expected, abs=0.0015)
    steady = taken(start, AllParticles(DUST, 0.05, "quasi_steady"), 20, 0.05)
    assert abs(steady.velocity[0, 2] - expected) > 0.01


def test_a_settling_pair_keeps_its_distance_and_falls_as_the_dense_mobility_says():
    side = 30.0
    positions = np.array([[3.0, 4.0, 5.0], [5.0, 4.0, 6.5]])
    closure = AllParticles(DUST, STEP, "quasi_steady", tolerance=1e-6)
    end = taken(in_cube(positions, side), closure, 200)
    expected = periodic_mobility(end.position, side, 1e-10) @ np.tile([0.0, 0.0, -1.0], 2)
    np.testing.assert_allclose(end.velocity, expected.reshape(2, 3), atol=1e-5)
    np.testing.assert_allclose(
        end.position[1] - end.position[0], positions[1] - positions[0], atol=1e-5
    )


def test_a_fluid_without_inertia_is_quasi_steady():
    thin = replace(DUST, fluid_density=1e-6)
    assert thin.galileo < 1e-6
    start = random_start(60, 1e-3, seed=1)
    ends = [
        taken(start, AllParticles(thin, STEP, fluid), 30) for fluid in ("unsteady", "quasi_steady")
    ]
    np.testing.assert_allclose(ends[0].velocity, ends[1].velocity, atol=2e-3)
    other = taken(start, AllParticles(DUST, STEP), 30)
    assert np.abs(other.velocity - ends[1].velocity).max() > 0.01


def test_close_pairs_pass_no_momentum_to_the_fluid():
    """So that the mean drag is that of all particles together, whatever pairs do."""
    closure = AllParticles(DUST, STEP, tolerance=1e-5)
    state = random_start(300, 0.05, seed=2)
    state = taken(state, closure, 25)
    drag = closure(state)
    assert closure.statistics(state, drag)["stopped"] > 0
    on_fluid = closure.memory()["force"]
    np.testing.assert_allclose(drag.force.mean(axis=0), -on_fluid.mean(axis=0), atol=1e-5)
    assert np.abs(drag.force + on_fluid).max() > 0.1


@pytest.mark.slow
def test_the_drag_carries_the_weight_once_the_cloud_settles_steadily():
    closure = AllParticles(DUST, STEP)
    state = taken(random_start(1000, 1e-3, seed=3, velocity="stokes"), closure, 300)
    drags = []
    for _ in range(500):
        drag = closure(state)
        drags.append(drag.force[:, 2].mean())
        state = move(state, drag, STEP, STOKES)
    assert np.mean(drags) == pytest.approx(1.0, abs=1e-3)


def test_halving_the_step_quarters_the_error():
    start = random_start(40, 1e-3, seed=4)
    ends = [
        taken(start, AllParticles(DUST, size, tolerance=1e-6), round(1 / size), size).velocity
        for size in (0.2, 0.1, 0.05)
    ]
    order = np.log2(np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2]))
    assert 1.6 < order < 2.6


def test_spheres_that_fly_at_each_other_do_not_overlap_and_keep_their_momentum():
    positions = np.array([[10.0, 10.0, 10.0], [10.0, 10.0, 14.0]])
    velocity = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, -1.9]])
    closure = AllParticles(DUST, STEP, "quasi_steady")
    state = in_cube(positions, 40.0, velocity)
    stopped, nearest = 0, np.inf
    for _ in range(40):
        drag = closure(state)
        stopped += closure.statistics(state, drag)["stopped"]
        state = move(state, drag, STEP, STOKES)
        nearest = min(nearest, np.linalg.norm(state.position[0] - state.position[1]))
    assert stopped > 0
    assert nearest > 1.0
    assert abs(state.velocity[0, 2] - state.velocity[1, 2]) < 0.01


def test_spheres_of_a_dense_cloud_stay_apart():
    closure = AllParticles(DUST, STEP)
    state = random_start(300, 0.05, seed=5)
    stopped = 0
    for _ in range(30):
        drag = closure(state)
        stopped += closure.statistics(state, drag)["stopped"]
        state = move(state, drag, STEP, STOKES)
    assert stopped > 50
    side = state.box_length
    assert not cKDTree(state.position % side, boxsize=side).query_pairs(0.98)


def test_one_thread_and_two_give_the_same_bits():
    start = random_start(500, 1e-2, seed=6)
    one, two = (taken(start, AllParticles(DUST, STEP, threads=threads), 4) for threads in (1, 2))
    np.testing.assert_array_equal(one.velocity, two.velocity)
    np.testing.assert_array_equal(one.position, two.position)


@pytest.mark.parametrize("fluid", ["unsteady", "quasi_steady"])
def test_a_run_goes_on_from_its_memory_to_the_same_bits(fluid):
    start = random_start(50, 1e-3, seed=7)
    closure = AllParticles(DUST, STEP, fluid)
    middle = taken(start, closure, 5)
    memory = {name: array.copy() for name, array in closure.memory().items()}
    end = taken(middle, closure, 5)
    fresh = AllParticles(DUST, STEP, fluid)
    fresh.remember(memory)
    again = State(middle.position, middle.velocity, middle.volume_fraction, middle.steps)
    again = taken(replace(again, last_drag=middle.last_drag), fresh, 5)
    np.testing.assert_array_equal(again.velocity, end.velocity)
    other = AllParticles(DUST, STEP, "quasi_steady" if fluid == "unsteady" else "unsteady")
    with pytest.raises(ValueError, match="memory of a run"):
        other.remember(memory)


def test_a_run_that_was_stopped_ends_with_the_same_bits(tmp_path):
    def run(name, checkpoint=None, progress=None):
        output = Output(tmp_path / f"{name}.nc", tmp_path / f"{name}.series.nc")
        schedule = Schedule(STEP, 1.0, 0.5)
        start = random_start(30, 1e-3, seed=8)
        settle(AllParticles(DUST, STEP), start, DUST, schedule, output, checkpoint, progress)
        return output.trajectory.read_bytes(), output.series.read_bytes()

    class Crash(Exception):
        pass

    def crash(done, steps):
        if done == 6:
            raise Crash

    checkpoint = Checkpoint(tmp_path / "checkpoint", 0.0)
    with pytest.raises(Crash):
        run("crashed", checkpoint, crash)
    assert checkpoint.folder.exists()
    whole, resumed = run("whole"), run("crashed", checkpoint)
    assert whole == resumed


@pytest.mark.parametrize("fluid", ["unsteady", "quasi_steady"])
def test_a_second_cloud_meets_nothing_of_the_first(fluid):
    used = AllParticles(DUST, STEP, fluid)
    taken(random_start(50, 1e-3, seed=7), used, 3)
    one_more = random_start(50, 1e-3, seed=8)
    # That has moved, among fewer and farther ones.
    others = [replace(random_start(n, phi, seed=8), steps=3) for n, phi in ((40, 1e-3), (40, 1e-4))]
    for start in (one_more, *others):
        here, there = (taken(start, c, 2) for c in (used, AllParticles(DUST, STEP, fluid)))
        np.testing.assert_array_equal(here.velocity, there.velocity)
        np.testing.assert_array_equal(here.position, there.position)


def test_conjugate_gradients_solve_what_an_exact_method_solves(monkeypatch):
    rng = np.random.default_rng(9)
    root = rng.normal(size=(12, 12))
    matrix = root @ root.T + np.eye(12)
    right = rng.normal(size=(4, 3))
    found, products = conjugate_gradients(
        lambda x: (matrix @ x.ravel()).reshape(4, 3), right, np.zeros((4, 3)), 1e-10
    )
    np.testing.assert_allclose(found.ravel(), np.linalg.solve(matrix, right.ravel()), atol=1e-8)
    assert products <= 20
    monkeypatch.setattr("dustfall.suspension.conjugate_gradients.MOST_PRODUCTS", 3)
    with pytest.raises(FloatingPointError, match="after 3 products"):
        conjugate_gradients(
            lambda x: (matrix @ x.ravel()).reshape(4, 3), right, np.zeros((4, 3)), 1e-10
        )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"fluid": "steady"}, "fluid is 'steady': allowed are unsteady, quasi_steady"),
        ({"step": 0.0}, "step is 0.0"),
        ({"shortest_memory": np.nan}, "shortest_memory is nan"),
    ],
)
def test_bad_settings_are_refused_by_name(settings, message):
    with pytest.raises(ValueError, match=message):
        AllParticles(DUST, **{"step": STEP} | settings)
