"""Boundary elements on meshed scenes: exact values, symmetries, honest estimates, other methods."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dustfall.scenes import random_scenes
from dustfall.stokes import Status, fixed_spheres
from dustfall.stokes.elements.scene import NARROWEST_GAP, fixed_spheres_on_meshes
from dustfall.stokes.references.exact_pairs import pair_drag
from tests.stokes.clusters import chain, six, triangle


def pair(s):
    return np.array([[0.0, 0.0, 0.0], [0.0, 0.0, s / 2.0]])


def assert_covered(solution, expected, tolerance):
    """Every sphere is as near to the expected force (n, 3) as the solution says, or nearer."""
    error = np.linalg.norm(solution.force - expected, axis=1) / 24.0
    assert (error <= solution.error_estimate).all()
    if solution.status == Status.CONVERGED:
        assert (solution.error_estimate <= tolerance).all()


def test_a_lone_sphere_feels_the_stokes_drag():
    solution = fixed_spheres_on_meshes([[3.0, -1.0, 2.0]], (0.0, 0.0, -5.0), 1e-4)
    assert solution.status == Status.CONVERGED
    assert_covered(solution, np.array([[0.0, 0.0, -24.0]]), 1e-4)
    assert solution.minimum_gap == np.inf


@pytest.mark.parametrize("s", [2.02, 2.1, 2.5, 3.0, 10.0, 1000.0])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_two_spheres_feel_the_exact_force_within_the_estimate(s, tolerance):
    along, across = pair_drag(s / 2.0)
    for axis, value in ((2, along), (1, across)):
        solution = fixed_spheres_on_meshes(pair(s), np.eye(3)[axis], tolerance)
        assert solution.status == Status.CONVERGED
        assert_covered(solution, 24.0 * value * np.eye(3)[[axis, axis]], tolerance)


def test_two_spheres_to_six_digits():
    solution = fixed_spheres_on_meshes(pair(5.0), (0.0, 0.0, 1.0), 1e-6)
    assert solution.status == Status.CONVERGED
    assert_covered(solution, 24.0 * pair_drag(2.5)[0] * np.eye(3)[[2, 2]], 1e-6)


@pytest.mark.parametrize(
    ("centres", "axis", "sphere", "expected"),
    [
        (triangle(2.02), 2, 0, 0.57695375),
        (triangle(3.0), 2, 0, 0.6628208613),
        (chain(3.0), 2, 1, 0.4427135664),
        pytest.param(six(2.1), 0, 0, 0.1734726834, marks=pytest.mark.slow),
        (six(3.0), 2, 0, 0.3026925458),
    ],
)
def test_more_spheres_feel_the_known_force(centres, axis, sphere, expected):
    solution = fixed_spheres_on_meshes(centres, np.eye(3)[axis], 1e-4)
    error = abs(solution.force[sphere, axis] / 24.0 - expected)
    assert error <= min(solution.error_estimate[sphere], 1e-4)


def test_a_tighter_tolerance_brings_a_smaller_error():
    expected = 24.0 * pair_drag(1.5)[0]
    errors = [
        abs(fixed_spheres_on_meshes(pair(3.0), (0, 0, 1), tolerance).force[0, 2] - expected)
        for tolerance in (1e-4, 1e-5, 1e-6)
    ]
    # From one level to the next the edges shrink by a quarter: third order in the force at least.
    assert errors[1] < errors[0] / 2.0
    assert errors[2] < errors[1] / 2.0


@pytest.mark.parametrize("s", [2.04, 3.0])
def test_forces_turn_with_the_scene_within_the_estimates(s):
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    flow = np.array([0.0, 1.0, 0.0])
    here = fixed_spheres_on_meshes(triangle(s), flow)
    there = fixed_spheres_on_meshes(turn.apply(triangle(s)), turn.apply(flow))
    error = np.linalg.norm(turn.apply(here.force) - there.force, axis=1) / 24.0
    assert (error <= here.error_estimate + there.error_estimate).all()


def test_neither_the_place_nor_the_speed_matters():
    here = fixed_spheres_on_meshes(triangle(2.5))
    there = fixed_spheres_on_meshes(triangle(2.5) + np.array([1e3, -2e3, 5e2]), (0.0, 7.0, 0.0))
    np.testing.assert_allclose(there.force, here.force, atol=1e-6)


def test_far_pairs_within_a_cluster_are_not_forgotten():
    """The outer spheres of a chain are not near, though all three are near the middle one."""
    centres = chain(2.3)
    meshed = fixed_spheres_on_meshes(centres, (1.0, 0.0, 0.0))
    assert_covered(meshed, fixed_spheres(centres, (1.0, 0.0, 0.0), 1e-6).force, 1e-4)


def test_a_scene_has_the_same_bits_whatever_was_solved_before():
    first = fixed_spheres_on_meshes(triangle(2.3)).force
    fixed_spheres_on_meshes(pair(2.02))
    np.testing.assert_array_equal(fixed_spheres_on_meshes(triangle(2.3)).force, first)


@pytest.mark.parametrize(("law", "count"), [("uniform", 40), ("contact", 6)])
def test_elements_and_multipoles_agree_within_both_estimates(law, count):
    neighbours, _ = random_scenes(5, law, range(count), (1e-8, 1e-3))
    for scene in neighbours:
        centres = np.concatenate([np.zeros((1, 3)), scene])
        meshed = fixed_spheres_on_meshes(centres)
        multipole = fixed_spheres(centres, tolerance=1e-6)
        error = np.linalg.norm(meshed.force - multipole.force, axis=1) / 24.0
        assert (error <= meshed.error_estimate + multipole.error_estimate).all()
        assert meshed.status == Status.CONVERGED


def test_tractions_add_up_to_the_force():
    solution = fixed_spheres_on_meshes(triangle(2.3))
    for sphere, traction, force in zip(
        solution.spheres, solution.traction, solution.force, strict=True
    ):
        total = sphere.exchange.spread.sum(axis=1) @ traction
        np.testing.assert_allclose(24.0 / (3.0 * np.pi) * total, force, atol=1e-5)


def test_only_a_sphere_with_a_narrow_gap_has_a_finer_mesh():
    centres = np.concatenate([pair(2.02), [[0.0, 9.0, 0.0]]])
    near, other, far = fixed_spheres_on_meshes(centres).spheres
    assert near.template is other.template
    assert len(near.mesh().triangles) > len(far.mesh().triangles)
    for sphere, towards in ((near, 1.0), (other, -1.0)):
        ends = sphere.mesh().vertices[sphere.mesh().edges]
        length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
        facing = towards * ends.mean(axis=1)[:, 2] > 0.97
        assert length[facing].max() < 0.5 * np.median(length[~facing])


def test_a_gap_too_narrow_for_a_mesh_is_out_of_reach():
    solution = fixed_spheres_on_meshes(pair(2.0 + NARROWEST_GAP))
    assert solution.status == Status.OUT_OF_REACH
    assert np.isnan(solution.force).all()
    assert np.isinf(solution.error_estimate).all()


@pytest.mark.slow
def test_the_narrowest_gaps_end_with_an_honest_word():
    along, _ = pair_drag(1.0 + 2e-4)
    solution = fixed_spheres_on_meshes(pair(2.0 + 4e-4), (0.0, 0.0, 1.0), 1e-3)
    assert_covered(solution, 24.0 * along * np.eye(3)[[2, 2]], 1e-3)


def test_no_flow_no_force():
    solution = fixed_spheres_on_meshes(triangle(3.0), (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(solution.force, np.zeros((3, 3)))
    assert solution.status == Status.CONVERGED


def test_methods_are_chosen_by_name_and_bad_input_is_refused_by_all():
    assert fixed_spheres(pair(3.0), method="elements").spheres
    for method in ("multipole", "elements", "paper"):
        with pytest.raises(ValueError, match="overlap"):
            fixed_spheres(pair(1.0), method=method)
        with pytest.raises(ValueError, match="tolerance"):
            fixed_spheres(pair(3.0), tolerance=1.0, method=method)
        with pytest.raises(ValueError, match="flow"):
            fixed_spheres(pair(3.0), (0.0, np.nan, 0.0), method=method)
