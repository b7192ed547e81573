"""The independent reference: exact pairs, known clusters, motions, no slip, an honest estimate."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from dustfall.stokes import forces_on_fixed_spheres
from dustfall.stokes.references import fundamental_solutions
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres
from dustfall.stokes.references.fundamental_solutions import (
    Spheres,
    reference_forces,
    reference_loads,
    solve_with,
)
from dustfall.stokes.references.moving_pairs import loads_on_two_spheres
from tests.stokes.clusters import chain, six, triangle

OBLIQUE = np.array([0.3, 0.9, -0.5])


def pair(s):
    return np.array([[0.2, 0.1, -0.4], [0.2 + 0.3 * s, 0.1, -0.4 + 0.4 * s]])


def error_and_estimate(s, tolerance):
    force, estimate = reference_forces(pair(s), OBLIQUE, tolerance)
    return np.abs(force - forces_on_two_spheres(pair(s), OBLIQUE)).max() / 24.0, estimate


@pytest.mark.parametrize(
    ("s", "tolerance"),
    [(2.05, 1e-6), (2.1, 1e-7), (2.5, 1e-10), (3.0, 1e-11), (5.0, 1e-11), (20.0, 1e-12)],
)
def test_two_spheres_feel_the_exact_force_within_estimate_and_tolerance(s, tolerance):
    error, estimate = error_and_estimate(s, tolerance)
    assert error <= estimate <= tolerance


@pytest.mark.slow
@pytest.mark.parametrize(("s", "tolerance"), [(2.02, 1e-5), (2.05, 1e-7)])
def test_two_nearly_touching_spheres_feel_the_exact_force(s, tolerance):
    error, estimate = error_and_estimate(s, tolerance)
    assert error <= estimate <= tolerance


def test_isolated_sphere_feels_stokes_drag_in_stokes_flow():
    force, _ = reference_forces([[3.0, -1.0, 2.0]], OBLIQUE)
    np.testing.assert_allclose(force[0], 24.0 * OBLIQUE / np.linalg.norm(OBLIQUE), rtol=1e-12)

    solution = solve_with(675, Spheres.fixed(np.zeros((1, 3)), np.array([0.0, 1.0, 0.0])))
    points = np.random.default_rng(2).normal(scale=2.0, size=(50, 3))
    points = points[np.linalg.norm(points, axis=1) > 0.55]
    r = 2.0 * np.linalg.norm(points, axis=1)
    near, far = 0.75 / r - 0.75 / r**3, 0.75 / r + 0.25 / r**3
    expected = -(near * 2.0 * points[:, 1] / r)[:, None] * (2.0 * points / r[:, None])
    expected[:, 1] += 1.0 - far
    np.testing.assert_allclose(solution.velocity(points), expected, atol=1e-12)


# Values on which two independent methods agree to the digits given, or which one method gives.
MORE_SPHERES = [
    (triangle(3.0), 2, {0: 0.662821}),
    (triangle(10.0), 2, {0: 0.868981}),
    (chain(3.0), 2, {0: 0.646844, 1: 0.442714}),
    (chain(10.0), 2, {0: 0.825828, 1: 0.754613}),
    (chain(3.0), 1, {0: 0.743022, 1: 0.618113}),
    (six(3.0), 0, {0: 0.264987}),
    (six(3.0), 2, {0: 0.302693}),
]


@pytest.mark.parametrize(("centres", "axis", "expected"), MORE_SPHERES)
def test_more_spheres_feel_the_known_force(centres, axis, expected):
    force, estimate = reference_forces(centres, np.eye(3)[axis], 1e-8)
    assert estimate <= 1e-8
    for sphere, value in expected.items():
        assert force[sphere, axis] / 24.0 == pytest.approx(value, abs=5.1e-7)


def test_the_solver_agrees():
    reference, _ = reference_forces(six(6.0), OBLIQUE)
    solved = forces_on_fixed_spheres(six(6.0), OBLIQUE, tolerance=1e-4)
    np.testing.assert_allclose(solved, reference, atol=24e-4)


def test_fluid_rests_on_all_spheres_and_ever_better_with_more_forces():
    centres = triangle(2.6)
    spheres = Spheres.fixed(centres, OBLIQUE / np.linalg.norm(OBLIQUE))
    slips = [solve_with(number, spheres).slip().max() for number in (200, 450, 1012)]
    assert slips[0] < 1e-3
    assert slips[1] < slips[0] / 10.0
    assert slips[2] < slips[1] / 10.0


def test_resistance_is_symmetric():
    """Lorentz reciprocity: the total force matrix of a cluster is symmetric."""
    centres = np.array([[0, 0, 0], [1.3, 0.2, 0.1], [0.3, 1.5, -0.4], [-0.9, 0.3, 1.2]])
    total = np.array([reference_forces(centres, e, 1e-7)[0].sum(axis=0) for e in np.eye(3)])
    np.testing.assert_allclose(total, total.T, atol=24e-7)
    assert np.abs(total - np.diag(np.diag(total))).max() > 0.1
    assert np.linalg.eigvalsh(total).min() > 0.0


def test_force_turns_with_the_scene_and_does_not_depend_on_place_or_speed():
    centres = triangle(2.6)
    force, _ = reference_forces(centres, OBLIQUE)
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    turned, _ = reference_forces(centres @ turn.T + [100.0, 0.0, -30.0], 5.0 * turn @ OBLIQUE)
    np.testing.assert_allclose(turned, force @ turn.T, atol=24e-8)


def test_what_the_ladder_cannot_reach_shows_in_the_estimate(monkeypatch):
    monkeypatch.setattr(fundamental_solutions, "MOST_INTERACTIONS", 5e5)
    error, estimate = error_and_estimate(2.02, 1e-8)
    assert error <= estimate
    assert estimate > 1e-6


def test_lattice_turns_onto_itself_and_is_evenly_spread():
    lattice = fundamental_solutions._lattice(600, 17, 0.25)
    points = lattice.reshape(-1, 3)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0, rtol=1e-12)
    turn = Rotation.from_rotvec([0.0, 0.0, 2.0 * np.pi / 17]).as_matrix()
    np.testing.assert_allclose(lattice[:-1] @ turn.T, lattice[1:], atol=1e-12)
    assert 600 <= len(points) <= 720
    everywhere = np.random.default_rng(1).normal(size=(4000, 3))
    everywhere /= np.linalg.norm(everywhere, axis=1)[:, None]
    assert cdist(everywhere, points).min(axis=1).max() < 1.1 * np.sqrt(4.0 * np.pi / 600)


def test_no_flow_gives_no_force():
    force, estimate = reference_forces(pair(3.0), (0, 0, 0))
    np.testing.assert_array_equal(force, np.zeros((2, 3)))
    assert estimate == 0.0


@pytest.mark.parametrize(
    ("centres", "flow", "tolerance", "message"),
    [
        (np.zeros((2, 2)), OBLIQUE, 1e-6, "shape"),
        (np.zeros((0, 3)), OBLIQUE, 1e-6, "shape"),
        ([[0, 0, 0], [np.nan, 0, 0]], OBLIQUE, 1e-6, "sphere 1 is not finite"),
        ([[0, 0, 0], [5, 0, 0], [5, 1.0, 0]], OBLIQUE, 1e-6, "spheres 1 and 2 overlap or touch"),
        (pair(3.0), [0.0, 1.0], 1e-6, "three finite numbers"),
        (pair(3.0), OBLIQUE, 1e-14, r"tolerance 1e-14.*allowed are"),
    ],
)
def test_bad_input_is_refused(centres, flow, tolerance, message):
    with pytest.raises(ValueError, match=message):
        reference_forces(centres, flow, tolerance)


def motion(n, seed):
    """Velocities, angular velocities, flow and a gradient without trace."""
    rng = np.random.default_rng(seed)
    gradient = rng.normal(size=(3, 3))
    return {
        "velocity": rng.normal(size=(n, 3)),
        "angular_velocity": rng.normal(size=(n, 3)),
        "flow": rng.normal(size=3),
        "gradient": gradient - np.trace(gradient) / 3.0 * np.eye(3),
    }


THREE = np.array([[0.0, 0.0, 0.0], [1.1, 0.5, -0.2], [-0.3, 1.4, 0.6]])
THREE_RADII = np.array([0.5, 0.6, 0.8])


@pytest.mark.parametrize(
    ("gap", "radii", "tolerance"),
    [(0.5, (0.5, 0.5), 1e-9), (0.1, (0.5, 0.5), 1e-7), (0.5, (0.5, 1.0), 1e-8)],
)
def test_two_spheres_that_move_feel_the_exact_loads_within_estimate_and_tolerance(
    gap, radii, tolerance
):
    line = np.array([2.0, 3.0, 6.0]) / 7.0
    centres = np.array([np.zeros(3), (sum(radii) + gap) * line])
    moving = motion(2, 1)
    found = reference_loads(centres, **moving, radii=radii, tolerance=tolerance)
    exact = loads_on_two_spheres(centres, **moving, radii=radii)
    assert (found.error_estimate <= tolerance).all()
    diameter = 2.0 * np.array(radii)
    for name, power in (("force", 1), ("torque", 2), ("stresslet", 2)):
        own, other = (getattr(loads, name).reshape(2, -1) for loads in (found, exact))
        size = np.maximum(np.linalg.norm(other, axis=1) / diameter**power, 1.0)
        error = np.linalg.norm(own - other, axis=1) / diameter**power / size
        assert (error <= found.error_estimate).all()


@pytest.mark.slow
def test_the_slip_shows_where_a_large_sphere_cannot_resolve_a_small_one(monkeypatch):
    """Both last rungs miss the small sphere's image alike: their difference says nothing."""
    monkeypatch.setattr(fundamental_solutions, "MOST_INTERACTIONS", 1e6)
    centres, radii = np.array([[0.0, 0.0, 0.0], [0.0, 1.85, 0.0]]), (0.3, 1.5)
    moving = motion(2, 1)
    found = reference_loads(centres, **moving, radii=radii, tolerance=1e-6)
    exact = loads_on_two_spheres(centres, **moving, radii=radii).force
    error = np.abs(found.force - exact).max() / np.abs(exact).max()
    assert 1e-5 < error < found.error_estimate.max()


def test_loads_of_two_motions_are_reciprocal():
    """Lorentz: what each motion's loads would do in the other motion is the same."""
    loads, motions = [], []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        velocity, turning, strain = rng.normal(size=(3, 3, 3))
        strain = strain + strain.T - 2.0 / 3.0 * np.trace(strain) * np.eye(3)
        found = reference_loads(
            THREE, velocity, turning, gradient=strain, radii=THREE_RADII, tolerance=1e-5
        )
        loads.append(found)
        motions.append((velocity - THREE @ strain.T, turning, strain))

    def work(load, other):
        velocity, turning, strain = other
        found = 3.0 * (load.force * velocity).sum() + (load.torque * turning).sum()
        return found - (load.stresslet * strain).sum()

    assert work(loads[0], motions[1]) == pytest.approx(work(loads[1], motions[0]), abs=1e-6)
    assert work(loads[0], motions[0]) < 0.0


def test_spheres_that_move_with_a_rigid_flow_feel_nothing():
    spin, flow = np.array([0.3, -1.0, 0.7]), np.array([1.0, 2.0, -0.5])
    gradient = np.cross(spin, np.eye(3)).T
    motions = flow + THREE @ gradient.T, np.tile(spin, (3, 1))
    found = reference_loads(THREE, *motions, flow, gradient, THREE_RADII)
    assert np.abs(found.force).max() < 1e-12
    assert np.abs(found.torque).max() < 1e-12
    still = reference_loads(THREE, np.zeros((3, 3)), radii=THREE_RADII)
    assert not still.force.any()
    assert not still.error_estimate.any()


def test_spheres_at_rest_feel_what_fixed_ones_feel():
    centres, flow = triangle(3.0), OBLIQUE / np.linalg.norm(OBLIQUE)
    fixed, _ = reference_forces(centres, flow, 1e-8)
    found = reference_loads(centres, np.zeros((3, 3)), flow=flow, tolerance=1e-8)
    np.testing.assert_allclose(24.0 * found.force, fixed, atol=24e-8)


def test_loads_scale_with_the_size_of_the_scene():
    moving = motion(3, 4)
    small = reference_loads(THREE, **moving, radii=THREE_RADII, tolerance=1e-4)
    moving["gradient"] = moving["gradient"] / 7.0
    moving["angular_velocity"] = moving["angular_velocity"] / 7.0
    large = reference_loads(7.0 * THREE, **moving, radii=7.0 * THREE_RADII, tolerance=1e-4)
    np.testing.assert_allclose(large.force, 7.0 * small.force, rtol=1e-6)
    np.testing.assert_allclose(large.torque, 49.0 * small.torque, rtol=1e-6)
    np.testing.assert_allclose(large.stresslet, 49.0 * small.stresslet, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"velocity": np.zeros((2, 3))}, "velocity must"),
        ({"angular_velocity": np.full((3, 3), np.inf)}, "angular_velocity"),
        ({"gradient": np.eye(3)}, "gradient has the trace"),
        ({"radii": [0.5, 0.5]}, "radii must"),
        ({"radii": [0.5, 0.5, 0.0]}, "radius of sphere 2 is 0.0"),
        ({"radii": [0.5, 0.9, 0.8]}, "spheres 0 and 1 overlap or touch"),
    ],
)
def test_motions_that_mean_nothing_are_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        reference_loads(**({"centres": THREE, "radii": THREE_RADII} | motion(3, 5) | changed))
