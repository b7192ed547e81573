"""A step is exact for a drag law that holds, and for a constant force the midpoint rule."""

import numpy as np
import pytest

from dustfall.sedimentation import Closure, Drag, State, move, step
from dustfall.sedimentation.state import check_closure

RNG = np.random.default_rng(7)


@pytest.mark.parametrize("beta", [0.0, 1e-9, 0.01, 0.3, 1.0, 2.0, -0.2])
@pytest.mark.parametrize("step", [0.05, 0.17, 3.0])
def test_step_is_exact_for_constant_coefficients(beta, step):
    position, velocity = RNG.normal(size=(2, 1, 3))
    push = RNG.normal(size=(1, 3))
    state = move(State(position, velocity, 1e-3), Drag(np.array([beta]), push), step, 9.0)
    x, v = state.position, state.velocity
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


def test_a_constant_force_over_the_step_is_the_implicit_midpoint_rule():
    position, velocity, force = RNG.normal(size=(3, 4, 3))
    before = State(position, velocity, 1e-3, last_drag=Drag(np.ones(4), -force))
    after = move(before, Drag(np.zeros(4), force, whole_step=True), 0.3, 9.0)
    np.testing.assert_allclose(after.velocity, velocity + 0.3 * (force - [0, 0, 1]), atol=1e-14)
    mean = (velocity + after.velocity) / 2
    np.testing.assert_allclose(after.position, position + 9.0 * 0.3 * mean, atol=1e-13)
    assert after.steps == 1


def test_a_closure_made_for_another_step_is_refused():
    class Yearly(Closure):
        name, step = "yearly", 365.0

        def __call__(self, state):
            return Drag(np.ones(1), np.zeros((1, 3)))

    state = State(np.zeros((1, 3)), np.zeros((1, 3)), 1e-3)
    with pytest.raises(ValueError, match=r"yearly is made for a step of 365\.0 tau, not 0\.1"):
        step(state, Yearly(), 0.1, 9.0)
    assert step(state, Yearly(), 365.0, 9.0).steps == 1


@pytest.mark.parametrize(
    ("made_for", "told"),
    [
        ({"stokes_number": 8.0}, r"Stokes number v_s tau / d_p of 8\.0, not 9\.0"),
        ({"volume_fraction": 1e-5}, r"volume fraction phi of 1e-05, not 0\.001"),
        ({"viscosity": 2.0}, r"kinematic viscosity in d_p\^2 / tau of 2\.0, not 1\.0"),
    ],
)
def test_a_closure_made_for_another_cloud_or_fluid_is_refused(made_for, told):
    class Particular(Closure):
        name = "particular"

        def __call__(self, state):
            return Drag(np.ones(1), np.zeros((1, 3)))

    closure = Particular()
    check_closure(closure, 0.1, 9.0, 1e-3, 1.0)
    vars(closure).update(made_for)
    with pytest.raises(ValueError, match=f"particular is made for a {told}"):
        check_closure(closure, 0.1, 9.0, 1e-3, 1.0)
    if "viscosity" not in made_for:
        state = State(np.zeros((1, 3)), np.zeros((1, 3)), 1e-3)
        with pytest.raises(ValueError, match=told):
            step(state, closure, 0.1, 9.0)
