"""Two and three spheres that settle alone, against an independent integration.

The closure takes the force on each sphere as if the others moved with it: all spheres fixed in the
flow that this one meets. For two equal spheres from rest that is exact, as they never part. A
sphere that moves against its neighbours would need the whole resistance matrix, which neither
the closure nor this reference has.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dustfall.sedimentation import Closure, Drag, Properties, State, step
from dustfall.sedimentation.closures.nearest_neighbours import drag_coefficients
from dustfall.stokes import forces_on_fixed_spheres
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres, pair_drag
from dustfall.suspension.rotne_prager import rotne_prager_forces

STOKES_NUMBER = Properties().stokes_number

TOLERANCE = 1e-6


class AllSpheres:
    """Force on a sphere among all others, by a solver of fixed spheres, in the flow frame."""

    def __init__(self, solver):
        self.solver = solver

    def predict(self, neighbours):
        scenes = np.insert(neighbours, 0, 0.0, axis=1)
        return np.array([self.solver(scene)[0] for scene in scenes])


def multipoles(centres):
    return forces_on_fixed_spheres(centres, tolerance=TOLERANCE)


class OpenSpace(Closure):
    """Every sphere feels all others, and nothing is periodic."""

    def __init__(self, model):
        self.model = model

    def __call__(self, state):
        n = len(state.position)
        others = np.array([[j for j in range(n) if j != i] for i in range(n)])
        vectors = state.position[others] - state.position[:, None]
        return Drag(*drag_coefficients(self.model, state.velocity, vectors))


def settle_in_open_space(model, position, duration, size):
    """The package's own step without a box: positions and velocities at the end, from rest."""
    state = State(position, np.zeros_like(position, dtype=float), 1e-3)
    for _ in range(round(duration / size)):
        state = step(state, OpenSpace(model), size, STOKES_NUMBER)
    return state.position, state.velocity


def integrate(solver, position, duration):
    """The same law by scipy's adaptive Runge-Kutta method, with the flow in the box frame."""
    n = len(position)

    def rate(_, state):
        x, v = state.reshape(2, n, 3)
        force = np.zeros((n, 3))
        for i in range(n):
            speed = np.linalg.norm(v[i])
            if speed > 0:
                force[i] = speed * solver(x, flow=-v[i] / speed)[i] / 24
        return np.stack([STOKES_NUMBER * v, force - [0, 0, 1]]).ravel()

    start = np.stack([position, np.zeros((n, 3))]).ravel()
    end = solve_ivp(rate, (0, duration), start, rtol=1e-9, atol=1e-9).y[:, -1]
    return end.reshape(2, n, 3)


PAIRS = {
    "one above the other": [[0, 0, 0], [0, 0, 1.5]],
    "side by side": [[0, 0, 0], [1.25, 0, 0]],
    "oblique": [[0, 0, 0], [0.9, 0.4, 1.1]],
}


@pytest.mark.parametrize("pair", PAIRS)
def test_two_spheres_settle_as_the_exact_resistance_says(pair):
    position = np.array(PAIRS[pair], dtype=float)
    x, v = settle_in_open_space(AllSpheres(multipoles), position, 3.0, 0.1)
    # Equal spheres from rest never part: with the drag exact at their distance the velocity is
    # that of two linear equations, along and across the line of centres.
    line = position[1] - position[0]
    distance = np.linalg.norm(line)
    line = line / distance
    weight = np.array([0, 0, -1.0])
    for part, drag in zip(
        (line * (line @ weight), weight - line * (line @ weight)), pair_drag(distance), strict=True
    ):
        size = np.linalg.norm(part)
        if size > 0:
            fallen = STOKES_NUMBER * (3.0 - (1 - np.exp(-3.0 * drag)) / drag) / drag
            direction = part / size
            np.testing.assert_allclose(v @ direction, size * (1 - np.exp(-3 * drag)) / drag, 2e-4)
            np.testing.assert_allclose((x - position) @ direction, size * fallen, 2e-4)
    np.testing.assert_allclose(x[1] - x[0], position[1] - position[0], atol=1e-4)


@pytest.mark.parametrize("pair", PAIRS)
def test_exact_pair_is_its_own_integration(pair):
    position = np.array(PAIRS[pair], dtype=float)
    x, v = settle_in_open_space(AllSpheres(forces_on_two_spheres), position, 3.0, 0.01)
    expected_x, expected_v = integrate(forces_on_two_spheres, position, 3.0)
    np.testing.assert_allclose(v, expected_v, atol=1e-5)
    np.testing.assert_allclose(x, expected_x, atol=1e-4)


TRIPLE = np.array([[0, 0, 0], [2.2, 0.3, 0.5], [0.7, 1.9, -0.4]])


def test_three_spheres_settle_as_an_independent_integration_says():
    x, v = settle_in_open_space(AllSpheres(rotne_prager_forces), TRIPLE, 4.0, 0.01)
    expected_x, expected_v = integrate(rotne_prager_forces, TRIPLE, 4.0)
    np.testing.assert_allclose(v, expected_v, atol=1e-5)
    np.testing.assert_allclose(x, expected_x, atol=1e-4)
    parted = np.linalg.norm((x - x[0]) - (TRIPLE - TRIPLE[0]), axis=1)
    assert parted.max() > 0.1  # unlike two, three equal spheres move against each other


def test_three_spheres_by_multipoles_settle_as_an_independent_integration_says():
    def solver(centres, flow):
        return forces_on_fixed_spheres(centres, flow=flow, tolerance=TOLERANCE)

    x, v = settle_in_open_space(AllSpheres(multipoles), TRIPLE, 1.0, 0.05)
    expected_x, expected_v = integrate(solver, TRIPLE, 1.0)
    np.testing.assert_allclose(v, expected_v, atol=1e-4)
    np.testing.assert_allclose(x, expected_x, atol=1e-3)


def test_far_spheres_do_not_feel_each_other():
    position = np.array([[0, 0, 0], [1e6, 0, 0], [0, 0, 1e6]])
    _, v = settle_in_open_space(AllSpheres(rotne_prager_forces), position, 2.0, 0.1)
    np.testing.assert_allclose(v, np.tile([0, 0, np.exp(-2) - 1], (3, 1)), atol=1e-5)
