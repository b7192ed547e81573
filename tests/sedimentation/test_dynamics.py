import numpy as np
import pytest

from dustfall.forces.rotne_prager import RotnePrager, rotne_prager_forces
from dustfall.sedimentation.dynamics import advance, drag_coefficients

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
    beta, side_force = drag_coefficients(RotnePrager(), velocity, neighbours)
    drag = side_force - beta[:, None] * velocity
    expected = [
        rotne_prager_forces(np.vstack([np.zeros(3), r]), flow=-v)[0] / 24
        for r, v in zip(neighbours, velocity, strict=True)
    ]
    np.testing.assert_allclose(drag, expected, atol=1e-12)


def test_side_force_is_across_the_motion():
    neighbours, velocity = scenes(50), RNG.normal(size=(50, 3))
    _, side_force = drag_coefficients(RotnePrager(), velocity, neighbours)
    assert np.abs(side_force).max() > 1e-3
    np.testing.assert_allclose((side_force * velocity).sum(axis=1), 0, atol=1e-14)


def test_particle_at_rest_has_no_drag_and_the_beta_of_its_fall():
    neighbours = scenes(4)
    rest = np.zeros((4, 3))
    falling = rest - [0, 0, 1e-6]
    beta, side_force = drag_coefficients(ForeAndAft(), rest, neighbours)
    np.testing.assert_array_equal(side_force - beta[:, None] * rest, 0)
    np.testing.assert_array_equal(beta, drag_coefficients(ForeAndAft(), falling, neighbours)[0])


def test_force_that_is_not_finite_names_the_particle():
    with pytest.raises(FloatingPointError, match="particle 3"):
        drag_coefficients(Failing(), np.ones((5, 3)), scenes(5))


@pytest.mark.parametrize("beta", [0.0, 1e-9, 0.01, 0.3, 1.0, 2.0, -0.2])
@pytest.mark.parametrize("step", [0.05, 0.17, 3.0])
def test_step_is_exact_for_constant_coefficients(beta, step):
    position, velocity = RNG.normal(size=(2, 1, 3))
    push = RNG.normal(size=(1, 3))
    x, v = advance(position, velocity, np.array([beta]), push, step, 9.0)
    # The Taylor series of the exact solution, summed until nothing is left.
    derivative = push - [0, 0, 1] - beta * velocity
    expected_v, expected_x = velocity + step * derivative, position + 9 * step * velocity
    expected_x = expected_x + 9 * step**2 / 2 * derivative
    factor = step
    for k in range(2, 60):
        derivative = -beta * derivative
        factor *= step / k
        expected_v = expected_v + factor * derivative
        expected_x = expected_x + 9 * factor * step / (k + 1) * derivative
    np.testing.assert_allclose(v, expected_v, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(x, expected_x, rtol=1e-13, atol=1e-12)
