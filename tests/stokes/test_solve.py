"""Forces on fixed spheres: exact values, symmetries, honest errors."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from dustfall.scenes import random_scenes
from dustfall.stokes import Status, fixed_spheres, forces_on_fixed_spheres
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres, pair_drag
from tests.stokes.clusters import chain, six, triangle

FLOW = (0.36, 0.8, 0.48)


def pair(s):
    return np.array([[0.0, 0.0, 0.0], [0.0, 0.0, s / 2.0]])


def ratio(centres, axis, tolerance):
    """Force along the flow over the isolated drag, sphere by sphere."""
    return forces_on_fixed_spheres(centres, np.eye(3)[axis], tolerance)[:, axis] / 24.0


@pytest.mark.parametrize("s", [2.01, 2.1, 2.5, 3.0, 5.0, 10.0, 20.0, 1000.0])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_two_spheres_feel_the_exact_force(s, tolerance):
    exact = pair_drag(s / 2.0)
    for axis, value in ((2, exact[0]), (1, exact[1])):
        assert ratio(pair(s), axis, tolerance) == pytest.approx(float(value), abs=tolerance)


@pytest.mark.parametrize("s", [2.1, 3.0, 10.0])
def test_two_spheres_to_eight_digits(s):
    exact = pair_drag(s / 2.0)
    for axis, value in ((2, exact[0]), (1, exact[1])):
        assert ratio(pair(s), axis, 1e-8) == pytest.approx(float(value), abs=1e-8)


# Force over isolated drag by fundamental solutions, to the digits given.
MORE_SPHERES = [
    (triangle(2.02), 2, {0: 0.57695375}),
    (triangle(3.0), 2, {0: 0.6628208613}),
    (triangle(10.0), 2, {0: 0.8689805385}),
    (chain(3.0), 2, {0: 0.6468436065, 1: 0.4427135664}),
    (chain(10.0), 2, {0: 0.8258280577, 1: 0.7546132077}),
    (chain(3.0), 1, {0: 0.743022433, 1: 0.6181127389}),
    (six(2.05), 0, {0: 0.1679277798}),
    (six(2.1), 0, {0: 0.1734726834}),
    (six(3.0), 0, {0: 0.2649865768}),
    (six(3.0), 2, {0: 0.3026925458}),
]


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize(("centres", "axis", "expected"), MORE_SPHERES)
def test_more_spheres_feel_the_known_force(centres, axis, expected, tolerance):
    if tolerance == 1e-8 and pdist(centres).min() < 1.2:
        pytest.skip("nearer than the reference is known to 1e-8")
    force = ratio(centres, axis, tolerance)
    for sphere, value in expected.items():
        assert force[sphere] == pytest.approx(value, abs=tolerance)


def test_isolated_sphere_feels_stokes_drag():
    force = forces_on_fixed_spheres([[3.0, -1.0, 2.0]])
    np.testing.assert_allclose(force, [[0.0, 24.0, 0.0]], atol=24e-6)


def scene(number=11):
    neighbours, _ = random_scenes(3, "uniform", [number], (5e-4, 1e-3))
    return np.concatenate([np.zeros((1, 3)), neighbours[0]])


@pytest.fixture(scope="module", params=["far", "near"])
def cluster(request):
    centres = scene()
    if request.param == "near":
        centres[1] = [0.6, 0.5, 0.66]
    return centres


def test_force_turns_with_the_scene(cluster):
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    flow = np.array([0.3, 0.9, -0.2])
    force = forces_on_fixed_spheres(cluster, flow)
    turned = forces_on_fixed_spheres(cluster @ turn.T, turn @ flow)
    np.testing.assert_allclose(turned, force @ turn.T, atol=24e-4)


def test_force_does_not_depend_on_place_order_or_speed(cluster):
    force = forces_on_fixed_spheres(cluster)
    order = np.array([3, 0, 5, 1, 4, 2])
    np.testing.assert_allclose(forces_on_fixed_spheres(cluster[order]), force[order], atol=24e-5)
    np.testing.assert_allclose(forces_on_fixed_spheres(cluster + 1e3), force, atol=24e-5)
    np.testing.assert_allclose(forces_on_fixed_spheres(cluster, [0, 7.0, 0]), force, rtol=1e-12)


def test_force_is_unchanged_by_inversion_and_mirrored_by_mirrors(cluster):
    force = forces_on_fixed_spheres(cluster)
    np.testing.assert_allclose(forces_on_fixed_spheres(-cluster), force, atol=24e-4)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(
        forces_on_fixed_spheres(cluster * mirror), force * mirror, atol=24e-4
    )


def test_resistance_is_symmetric(cluster):
    """Lorentz reciprocity: the total force matrix of a cluster is symmetric."""
    total = np.array([forces_on_fixed_spheres(cluster, e, 1e-5).sum(axis=0) for e in np.eye(3)])
    np.testing.assert_allclose(total, total.T, atol=24e-5)
    assert np.linalg.eigvalsh(0.5 * (total + total.T)).min() > 0.0


@pytest.mark.parametrize("law", ["uniform", "ball"])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_error_estimate_bounds_the_error_and_stays_close_to_it(law, tolerance):
    neighbours, _ = random_scenes(8, law, range(150), (1e-8, 1e-3))
    true, estimated = [], []
    for own in neighbours:
        centres = np.concatenate([np.zeros((1, 3)), own])
        exact = fixed_spheres(centres, tolerance=1e-8)
        solution = fixed_spheres(centres, tolerance=tolerance)
        true.append(np.abs(solution.force - exact.force).max(axis=1) / 24.0)
        estimated.append(solution.error_estimate)
    true, estimated = np.array(true), np.array(estimated)
    assert true.max() < tolerance
    for spheres in (slice(0, 1), slice(None)):
        error, estimate = true[:, spheres], estimated[:, spheres]
        assert np.mean(estimate >= error) >= 0.999
        # Random fields cancel in part, a bound that adds them coherently does not: 13 is measured
        # at 1e-6, where a factor of 10 is wanted.
        assert np.median(estimate / np.maximum(error, 1e-12)) < 20.0


def test_gmres_that_runs_out_is_reported_not_hidden(monkeypatch):
    monkeypatch.setattr("dustfall.stokes.solve.MOST_ITERATIONS", 2)
    solution = fixed_spheres(six(2.6))
    assert solution.status == "not converged"
    assert solution.residual > 1e-6
    with pytest.raises(RuntimeError, match="GMRES stopped"):
        forces_on_fixed_spheres(six(2.6))


def test_a_tolerance_out_of_reach_is_said():
    with pytest.warns(RuntimeWarning, match="exceeds the tolerance"):
        forces_on_fixed_spheres(triangle(2.0002), tolerance=1e-8)
    solution = fixed_spheres(triangle(2.0002), tolerance=1e-8)
    assert solution.status == Status.OUT_OF_REACH == "out of reach"
    assert solution.error_estimate.min() > 1e-8


@pytest.mark.parametrize("gap", [2.3e-16, 1e-12, 1e-6])
def test_a_gap_of_almost_nothing_has_the_right_answer_or_is_out_of_reach(gap):
    centres = pair(2.0 + 2.0 * gap)
    for tolerance in (1e-3, 1e-6, 1e-8):
        solution = fixed_spheres(centres, FLOW, tolerance)
        error = np.abs(solution.force - forces_on_two_spheres(centres, FLOW)).max() / 24.0
        assert solution.status in ("converged", "out of reach")
        assert error <= tolerance
    assert fixed_spheres(centres, FLOW, 1e-3).status == "converged"


def test_a_solution_tells_the_smallest_gap():
    solution = fixed_spheres(chain(3.0))
    assert solution.minimum_gap == pytest.approx(0.5)
    assert solution.status == "converged"
    assert fixed_spheres([[0.0, 0.0, 0.0]]).minimum_gap == np.inf


def test_no_flow_gives_no_force():
    np.testing.assert_array_equal(forces_on_fixed_spheres(pair(3.0), (0, 0, 0)), np.zeros((2, 3)))


def test_a_method_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="method 'magic': allowed are multipole"):
        fixed_spheres(pair(3.0), method="magic")


def test_the_multipole_solve_meshes_nothing():
    code = (
        "import sys; from dustfall.stokes import forces_on_fixed_spheres as forces; "
        "forces([[0, 0, 0], [0, 0, 1.2]]); "
        "sys.exit(bool({'gmsh', 'dustfall.stokes.elements'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
