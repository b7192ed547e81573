import numpy as np
import pytest

from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.forces.learned import load_model
from dustfall.sedimentation import NearestNeighbours, nearest_neighbours, random_start
from dustfall.sedimentation.closures.nearest_neighbours import drag_coefficients
from dustfall.suspension.rotne_prager import rotne_prager_forces
from tests.sedimentation.runs import run

RNG = np.random.default_rng(7)


def scenes(m):
    direction = RNG.normal(size=(m, 5, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    return direction * (1 + np.arange(5)[:, None] + RNG.random((m, 5, 1)))


class ForeAndAft:
    """Less drag for neighbours downstream; real Stokes flow does not tell them from upstream."""

    def predict(self, neighbours):
        force = np.zeros((len(neighbours), 3))
        force[:, 1] = 24 - neighbours[:, :, 1].mean(axis=1)
        return force


class Failing:
    def predict(self, neighbours):
        force = np.zeros((len(neighbours), 3))
        force[3, 1] = np.nan
        return force


def test_drag_is_that_of_the_resistance_problem_in_the_box_frame():
    # The model knows flow along +y only; the resistance problem takes any direction of flow.
    neighbours, velocity = scenes(20), RNG.normal(size=(20, 3))
    velocity[0] = [0, 0, -1]
    velocity[1], velocity[2] = [0, 2, 0], [0, -2, 0]
    velocity[3] = [1e-13, 1, -1e-13]
    beta, lateral_force = drag_coefficients(ROTNE_PRAGER, velocity, neighbours)
    drag = lateral_force - beta[:, None] * velocity
    expected = [
        np.linalg.norm(v) * rotne_prager_forces(np.vstack([np.zeros(3), r]), flow=-v)[0] / 24
        for r, v in zip(neighbours, velocity, strict=True)
    ]
    np.testing.assert_allclose(drag, expected, atol=1e-12)


def test_lateral_force_is_across_the_motion():
    neighbours, velocity = scenes(50), RNG.normal(size=(50, 3))
    _, lateral_force = drag_coefficients(ROTNE_PRAGER, velocity, neighbours)
    assert np.abs(lateral_force).max() > 1e-3
    np.testing.assert_allclose((lateral_force * velocity).sum(axis=1), 0, atol=1e-14)


def test_particle_at_rest_has_no_drag_and_the_beta_of_its_fall():
    neighbours = scenes(4)
    rest = np.zeros((4, 3))
    falling = rest - [0, 0, 1e-6]
    beta, lateral_force = drag_coefficients(ForeAndAft(), rest, neighbours)
    np.testing.assert_array_equal(lateral_force - beta[:, None] * rest, 0)
    np.testing.assert_array_equal(beta, drag_coefficients(ForeAndAft(), falling, neighbours)[0])


def test_force_that_is_not_finite_names_the_particle():
    with pytest.raises(FloatingPointError, match="particle 3"):
        drag_coefficients(Failing(), np.ones((5, 3)), scenes(5))


@pytest.mark.parametrize("number", [1, 4, 20])
def test_closed_formulas_settle_with_any_number_of_neighbours(number):
    state = random_start(60, 1e-3, seed=3, velocity="stokes")
    drag = NearestNeighbours(ROTNE_PRAGER, number)(state)
    vectors, _ = nearest_neighbours(state.position, state.box_length, number)
    # The flow that all meet runs up, along z.
    expected = [rotne_prager_forces(np.vstack([np.zeros(3), r]), (0, 0, 1))[0] for r in vectors]
    np.testing.assert_allclose(drag.on(state.velocity), np.array(expected) / 24, atol=1e-12)


def test_the_number_of_neighbours_is_the_models_own():
    assert NearestNeighbours(load_model()).neighbours == 5
    with pytest.raises(ValueError, match="6 neighbours: the model takes 5"):
        NearestNeighbours(load_model(), 6)
    for number in (0, 51):
        with pytest.raises(ValueError, match="allowed are 1 to 50"):
            NearestNeighbours(ROTNE_PRAGER, number)


def test_a_closure_that_has_seen_another_cloud_starts_anew():
    closure = NearestNeighbours(ROTNE_PRAGER)
    closure(random_start(60, 1e-3, seed=1))
    for state in (random_start(60, 1e-5, seed=2), random_start(90, 1e-3, seed=3)):
        again, fresh = closure(state), NearestNeighbours(ROTNE_PRAGER)(state)
        np.testing.assert_array_equal(again.beta, fresh.beta)


def test_two_runs_of_one_closure_have_the_bits_of_two_closures(tmp_path):
    closure = NearestNeighbours(ROTNE_PRAGER)
    first, _ = run(tmp_path, closure=closure)
    second, _ = run(tmp_path, closure=closure)
    assert first.identical(second)
