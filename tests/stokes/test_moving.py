"""Spheres that move: exact values, reciprocity, symmetries, and errors that are what they say."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dustfall.benchmarks.moving_estimates import sampled
from dustfall.spheres import centre_distances
from dustfall.stokes import (
    Status,
    fixed_spheres,
    forces_on_fixed_spheres,
    mobility,
    resistance,
)
from dustfall.stokes.memory import available_memory
from dustfall.stokes.moving import needed_memory
from dustfall.stokes.moving_plan import plan_moving
from dustfall.stokes.references.fundamental_solutions import reference_loads
from dustfall.stokes.references.moving_pairs import loads_on_two_spheres
from tests.stokes.clusters import triangle

SHEAR = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])

MIXED = (
    np.array([[0.0, 0.0, 0.0], [1.4, 0.2, -0.1], [0.2, 0.3, 1.1], [-0.9, -0.6, 0.3]]),
    np.array([0.5, 0.8, 0.5, 0.3]),
)
"""Centres and radii of four spheres, whose smallest gap is 0.1 d_p."""


def motions(n, seed=2):
    """Velocities, angular velocities (n, 3) and a gradient without trace, at random."""
    rng = np.random.default_rng(seed)
    gradient = rng.standard_normal((3, 3))
    gradient -= np.trace(gradient) / 3.0 * np.eye(3)
    return *rng.standard_normal((2, n, 3)), gradient


@pytest.mark.parametrize("radius", [0.5, 3.0])
def test_a_lone_sphere_is_exact(radius):
    centre, radii, d = [[1.0, -2.0, 0.5]], [radius], 2.0 * radius
    velocity, turning, gradient = np.array([[0.3, 1.0, -2.0]]), np.array([[1.0, 0.5, 2.0]]), SHEAR
    found = resistance(centre, velocity, turning, radii=radii)
    np.testing.assert_allclose(found.force, -d * velocity, rtol=1e-12)
    np.testing.assert_allclose(found.torque, -(d**3) * turning, rtol=1e-12)
    np.testing.assert_allclose(found.stresslet, 0.0, atol=1e-12)
    held = resistance(centre, np.zeros((1, 3)), gradient=gradient, radii=radii)
    np.testing.assert_allclose(held.force, [[-2.0 * d, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(held.torque, [[0.0, 0.0, -0.5 * d**3]], atol=1e-12)
    strain = 0.5 * (gradient + gradient.T)
    np.testing.assert_allclose(held.stresslet[0], 5.0 / 6.0 * d**3 * strain, atol=1e-11)
    free = mobility(centre, d * velocity, d**3 * turning, [1.0, 0.0, 0.0], gradient, radii)
    np.testing.assert_allclose(free.velocity, velocity - [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(free.angular_velocity, turning - [0.0, 0.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(free.stresslet, held.stresslet, atol=1e-11)
    assert free.status == held.status == Status.CONVERGED


@pytest.mark.parametrize(
    ("s", "known"), [(3.0, 2.038655), (2.1, 7.413298), (2.02, 28.114022), (2.002, 254.143204)]
)
def test_approaching_spheres_feel_what_brenner_found(s, known):
    """Brenner 1961, a sphere and a plane free of shear: over 6 pi mu a U."""
    found = resistance([[0, 0, 0], [0, 0, s / 2.0]], [[0, 0, 1], [0, 0, -1]], tolerance=1e-7)
    np.testing.assert_allclose(found.force[:, 2], [-known, known], atol=1e-6)
    assert found.status == Status.CONVERGED


def test_spheres_at_rest_in_a_flow_are_fixed_spheres():
    centres = triangle(2.2)
    fixed = fixed_spheres(centres, (0.0, 0.6, 0.8), 1e-6)
    moving = resistance(centres, np.zeros((3, 3)), flow=(0.0, 0.6, 0.8), tolerance=1e-6)
    np.testing.assert_allclose(24.0 * moving.force, fixed.force, atol=24e-6)


@pytest.mark.parametrize(("gap", "tolerance"), [(0.1, 1e-3), (0.1, 1e-6), (0.01, 1e-3)])
def test_resistance_undoes_mobility(gap, tolerance):
    """Within the tolerance; the velocities are better by what lubrication makes of their error."""
    centres, radii = MIXED[0].copy(), MIXED[1]
    centres[1] *= (radii[0] + radii[1] + gap) / np.linalg.norm(centres[1])
    force, torque, gradient = motions(4)
    flow, d = (1.0, 2.0, 3.0), 2.0 * radii[:, None]
    free = mobility(centres, force, torque, flow, gradient, radii, max(gap * tolerance, 1e-8))
    held = resistance(
        centres, free.velocity, free.angular_velocity, flow, gradient, radii, tolerance
    )
    assert free.status == held.status == Status.CONVERGED
    assert (np.linalg.norm(held.force + force, axis=1) <= tolerance * d[:, 0]).all()
    assert (np.linalg.norm(held.torque + torque, axis=1) <= tolerance * d[:, 0] ** 2).all()
    apart = np.linalg.norm(held.stresslet - free.stresslet, axis=(1, 2))
    assert (apart <= tolerance * d[:, 0] ** 2 * held.scale).all()


def errors(found, exact, radii):
    """Error (n,) of loads, as `error_estimate` tells it."""
    d = 2.0 * np.asarray(radii)
    parts = [
        np.linalg.norm((getattr(found, name) - getattr(exact, name)).reshape(len(d), -1), axis=1)
        for name in ("force", "torque", "stresslet")
    ]
    return np.max([parts[0] / d, parts[1] / d**2, parts[2] / d**2], axis=0) / found.scale


@pytest.mark.parametrize("ratio", [1.0, 2.0, 10.0])
@pytest.mark.parametrize("gap", [1.0, 0.1, 1e-2, 1e-3, 1e-4])
def test_two_spheres_in_any_motion_feel_the_exact_loads(gap, ratio):
    radii = np.array([0.5, 0.5 * ratio])
    centres = np.outer([0.0, radii.sum() + gap], [0.48, -0.6, 0.64])
    velocity, turning, gradient = motions(2)
    motion = (velocity, turning, (1.0, 2.0, 3.0), gradient, radii)
    exact = loads_on_two_spheres(centres, *motion)
    for tolerance in (1e-4, 1e-6):
        found = resistance(centres, *motion, tolerance)
        error = errors(found, exact, radii)
        assert found.status == Status.CONVERGED
        assert (error <= found.error_estimate).all()
        assert error.max() <= tolerance


@pytest.mark.parametrize("gap", [0.1, 1e-4])
@pytest.mark.parametrize("ratio", [1.0, 10.0])
def test_two_spheres_move_as_the_exact_loads_of_their_motion_ask(gap, ratio):
    radii = np.array([0.5, 0.5 * ratio])
    centres = np.outer([0.0, radii.sum() + gap], [0.48, -0.6, 0.64])
    force, torque, gradient = motions(2)
    found = mobility(centres, force, torque, (0, 0, 0), gradient, radii, 1e-8)
    exact = loads_on_two_spheres(
        centres, found.velocity, found.angular_velocity, (0, 0, 0), gradient, radii
    )
    # Lubrication is an error of the velocity over the gap.
    np.testing.assert_allclose(exact.force, -force, atol=2e-8 * ratio**2 / gap)
    np.testing.assert_allclose(exact.torque, -torque, atol=2e-8 * ratio**2 / gap)
    np.testing.assert_allclose(exact.stresslet, found.stresslet, atol=2e-8 * ratio**2 / gap)


def crowd(n, mixed, seed):
    """Centres and radii of n spheres, 0.1 d_p apart or more."""
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.25, 0.8, n) if mixed else np.full(n, 0.5)
    centres = np.zeros((1, 3))
    while len(centres) < n:
        direction = rng.standard_normal(3)
        own, k = radii[len(centres)], rng.integers(len(centres))
        reach = radii[k] + own + 0.1 * 10.0 ** rng.random()
        place = centres[k] + reach * direction / np.linalg.norm(direction)
        apart = np.linalg.norm(centres - place, axis=1) - radii[: len(centres)] - own
        if apart.min() > 0.0999:
            centres = np.vstack([centres, place])
    return centres, radii


@pytest.mark.parametrize(("n", "mixed", "seed"), [(3, False, 1), (4, True, 2)])
def test_crowds_feel_what_fundamental_solutions_find(n, mixed, seed):
    centres, radii = crowd(n, mixed, seed)
    motion = (*motions(n, seed)[:2], (0.0, 0.0, 0.0), motions(n, seed)[2], radii)
    exact = reference_loads(centres, *motion, 1e-5)
    for tolerance in (1e-2, 1e-4):
        found = resistance(centres, *motion, tolerance)
        error = errors(found, exact, radii)
        assert found.status == Status.CONVERGED
        assert error.max() <= tolerance
        assert (error <= found.error_estimate + 1e-5).all()


def test_estimates_cover_the_errors_of_random_clusters():
    samples = sampled(4, tolerances=(1e-2, 1e-4), seed=3)
    converged = samples[samples["status"] == "converged"]
    assert len(converged) > 0.95 * len(samples)
    assert (converged["error"] <= converged["tolerance"]).all()
    assert (samples["estimate"] >= samples["error"]).mean() >= 0.99


def test_fixed_spheres_of_any_radii_are_spheres_that_do_not_move():
    centres, radii = MIXED
    still = np.zeros((4, 3))
    exact = reference_loads(centres, still, None, (0.0, 0.6, 0.8), None, radii, 1e-5)
    force = forces_on_fixed_spheres(centres, (0.0, 3.0, 4.0), 1e-4, radii)
    np.testing.assert_allclose(force, 24.0 * exact.force, atol=24e-4)
    equal = fixed_spheres(centres[:2], radii=[0.5, 0.5])
    np.testing.assert_array_equal(equal.force, fixed_spheres(centres[:2]).force)
    with pytest.raises(ValueError, match="'elements' takes equal spheres alone"):
        fixed_spheres(centres, method="elements", radii=radii)


def grand_matrix(solver, first, second, n):
    """Columns of force and torque, or velocities, for unit motions, or loads, of each sphere.

    In units in which rows times columns are powers: a torque's is a third of a force's.
    """
    columns = []
    for unit in np.eye(6 * n).reshape(-1, 2, n, 3):
        found = solver(unit[0], unit[1])
        columns.append(np.concatenate([getattr(found, first), getattr(found, second)]).ravel())
    return np.array(columns).T


def test_grand_matrices_are_symmetric_and_positive_definite_and_inverse():
    centres, radii = MIXED
    n = len(radii)
    power = np.repeat([1.0, 1.0 / 3.0], 3 * n)
    held = -power[:, None] * grand_matrix(
        lambda u, w: resistance(centres, u, w, radii=radii, tolerance=1e-6), "force", "torque", n
    )
    free = grand_matrix(
        lambda f, t: mobility(centres, f, t, radii=radii, tolerance=1e-6),
        "velocity", "angular_velocity", n,
    ) / power  # fmt: skip
    for matrix in (held, free):
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-6 * np.abs(matrix).max())
        assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > 0.0
    np.testing.assert_allclose(held @ free, np.eye(6 * n), atol=3e-5)


def test_a_stresslet_and_a_force_are_reciprocal():
    """Lorentz: the strain that a motion meets and the force that a strain makes."""
    centres, radii = MIXED
    velocity, turning, gradient = motions(4)
    strain = 0.5 * (gradient + gradient.T)
    moved = resistance(centres, velocity, turning, radii=radii, tolerance=1e-6)
    strained = resistance(centres, np.zeros((4, 3)), gradient=strain, radii=radii, tolerance=1e-6)
    # Power of the tractions of each in the velocities of the other, over 3 pi mu d_p U^2.
    flows = centres @ strain.T
    one = np.sum(moved.force * flows) + np.sum(moved.stresslet * strain) / 3.0
    other = -np.sum(strained.force * velocity) - np.sum(strained.torque * turning) / 3.0
    assert one == pytest.approx(other, abs=1e-5)


def test_loads_turn_move_and_mirror_with_the_scene():
    centres, radii = MIXED
    velocity, turning, gradient = motions(4)
    flow = np.array([0.3, -0.2, 1.0])
    base = resistance(centres, velocity, turning, flow, gradient, radii, 1e-5)
    place = np.array([3.0, -40.0, 7.0])
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    for matrix in (turn, np.diag([-1.0, 1.0, 1.0]) @ turn):
        handed = np.linalg.det(matrix)
        turned = resistance(
            centres @ matrix.T + place, velocity @ matrix.T, handed * turning @ matrix.T,
            matrix @ flow - matrix @ gradient @ matrix.T @ place, matrix @ gradient @ matrix.T,
            radii, 1e-5,
        )  # fmt: skip
        np.testing.assert_allclose(turned.force, base.force @ matrix.T, atol=1e-4)
        np.testing.assert_allclose(turned.torque, handed * base.torque @ matrix.T, atol=1e-4)
        stresslet = matrix @ base.stresslet @ matrix.T
        np.testing.assert_allclose(turned.stresslet, stresslet, atol=1e-4)


def test_a_unit_of_length_changes_nothing():
    centres, radii = MIXED
    velocity, turning, gradient = motions(4)
    base = resistance(centres, velocity, turning, gradient=gradient, radii=radii)
    large = resistance(
        8.0 * centres, velocity, turning / 8.0, gradient=gradient / 8.0, radii=8.0 * radii
    )
    np.testing.assert_allclose(large.force, 8.0 * base.force, rtol=1e-10)
    np.testing.assert_allclose(large.stresslet, 64.0 * base.stresslet, rtol=1e-10)


def test_nothing_that_moves_feels_nothing():
    found = resistance(triangle(2.1), np.tile([1.0, 2.0, 3.0], (3, 1)), flow=(1.0, 2.0, 3.0))
    assert found.status == Status.CONVERGED
    np.testing.assert_array_equal(found.force, np.zeros((3, 3)))
    drifting = mobility(triangle(2.1), np.zeros((3, 3)), flow=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(drifting.velocity, np.tile([1.0, 2.0, 3.0], (3, 1)))


def test_what_is_out_of_reach_is_said():
    """Three spheres that all but touch share more degrees than there are."""
    velocity, turning, _ = motions(3)
    found = resistance(triangle(2.01), velocity, turning, tolerance=1e-7)
    assert found.status != Status.CONVERGED
    assert found.error_estimate.max() > 1e-7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"centres": [[0, 0, 0], [0, 0, 1.2]]}, "spheres 0 and 1 overlap or touch.* 1.3 is needed"),
        ({"radii": [0.5]}, r"radii must have the shape \(2,\)"),
        ({"radii": [0.5, -1.0]}, "radius of sphere 1 is -1.0: it must be positive"),
        ({"radii": [1e-4, 0.5]}, "at most 1000 times the smallest"),
        ({"velocity": [[0, 0, 1]]}, r"velocity must have the shape \(2, 3\)"),
        ({"velocity": [[0, 0, 1], [0, np.nan, 0]]}, "velocity of sphere 1"),
        ({"gradient": np.eye(3)}, "trace 3: fluid keeps its volume"),
        ({"gradient": [1.0]}, r"gradient must be \(3, 3\)"),
        ({"tolerance": 1e-12}, "tolerance 1e-12: allowed are 1e-08 to 0.1"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(changes, message):
    scene = {"centres": [[0, 0, 0], [0, 0, 2]], "velocity": np.ones((2, 3)), "radii": [0.5, 0.8]}
    with pytest.raises(ValueError, match=message):
        resistance(**scene | changes)


def test_memory_that_is_not_there_is_not_taken(monkeypatch):
    assert available_memory() > needed_memory(triangle(3.0)) > 2**16
    monkeypatch.setattr("dustfall.stokes.memory.available_memory", lambda: 2**16)
    with pytest.raises(MemoryError, match=r"3 spheres take .* GiB .* only 0.0 GiB"):
        mobility(triangle(3.0), np.ones((3, 3)))


def test_spheres_that_nearly_touch_ask_no_more_degrees_of_others():
    """Where three spheres share more degrees than there are, others cannot make up for it."""
    lattice = 6.0 * np.indices((3, 3, 3)).reshape(3, -1).T

    def degrees(s):
        centres = np.vstack([lattice, triangle(s) - 6.0])
        plan = plan_moving(centre_distances(centres), np.full(30, 0.5), 1e-3, False, 4, 40)
        return plan.degrees[:27, :27]

    np.testing.assert_array_equal(degrees(2.0002), degrees(2.3))


def test_a_million_spheres_are_refused_before_their_distances_are_taken():
    with pytest.raises(MemoryError, match="1000000 spheres take"):
        mobility(np.zeros((1_000_000, 3)), np.zeros((1_000_000, 3)))


def test_a_gap_beyond_the_last_degree_is_no_convergence(monkeypatch):
    """With as many degrees as there are, that is 1e-7; with a tenth of them it is soon over."""
    # Approach: 1 / (2 gap) + 9/20 log(1 / gap) + 1.346, the gap in radii (Kim and Karrila 1991).
    monkeypatch.setattr("dustfall.stokes.moving_plan.MOST_ELIMINATED", 2_000)
    gap = 1e-5
    found = resistance([[0, 0, 0], [0, 0, 1 + gap]], [[0, 0, 1], [0, 0, -1]], tolerance=1e-4)
    exact = 0.25 / gap - 0.45 * np.log(2 * gap) + 1.346
    assert abs(found.force[1, 2] - exact) <= found.error_estimate[1] * found.scale[1]
    assert found.status == Status.OUT_OF_REACH
