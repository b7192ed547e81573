"""Forces on fixed spheres: exact values, symmetries, two independent couplings, honest errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dustfall.scenes import random_scenes
from dustfall.stokes import forces_on_fixed_spheres, many_body
from dustfall.stokes.many_body import CONVERGED, NEAR, NOT_CONVERGED, plan_scene, solve

BODIES = many_body._Bodies()

# Force / isolated drag on one of two equal spheres at s radii: along, across (Stimson and Jeffery
# 1926; Jeffrey and Onishi 1984).
PAIR = {
    2.1: (0.650900144515, 0.733131015965),
    2.5: (0.672915513765, 0.763785774824),
    3.0: (0.698304560250, 0.794925895255),
    5.0: (0.777239786668, 0.867501587313),
    10.0: (0.870600502898, 0.929865830469),
    20.0: (0.930360936289, 0.963801731055),
}


def pair(s):
    return np.array([[0.0, 0.0, 0.0], [0.0, 0.0, s / 2.0]])


def triangle(s):
    return s / 2.0 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])


def chain(s):
    return s / 2.0 * np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def six(s):
    arms = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    return s / 2.0 * np.array(arms, dtype=float)


def ratio(centres, axis, tolerance):
    """Force along the flow over the isolated drag, sphere by sphere."""
    return forces_on_fixed_spheres(centres, np.eye(3)[axis], tolerance)[:, axis] / 24.0


@pytest.mark.parametrize("s", PAIR)
@pytest.mark.parametrize(("axis", "which"), [(2, 0), (1, 1)])
def test_two_spheres_feel_the_exact_force(s, axis, which):
    bound = 1e-4 if s >= 2.5 else 1e-3
    assert ratio(pair(s), axis, 1e-4) == pytest.approx(PAIR[s][which], abs=bound)
    if s >= 3.0:
        assert ratio(pair(s), axis, 1e-6) == pytest.approx(PAIR[s][which], abs=1e-6)


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
    for tolerance, bound in ((1e-4, 1e-4), (1e-6, 4e-6)):
        force = ratio(centres, axis, tolerance)
        for sphere, value in expected.items():
            assert force[sphere] == pytest.approx(value, abs=bound)


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
        centres[1] = [0.6, 0.5, 0.72]
    plan = plan_scene(centres)
    assert (plan.orders == NEAR).any() == (request.param == "near")
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


def test_element_integrals_and_harmonics_agree():
    """The same spheres once through harmonics only, once integrated element by element."""
    plan = plan_scene(six(3.4), tolerance=1e-6)
    assert (plan.orders != NEAR).all()
    near = np.where(np.eye(6, dtype=bool), 0, NEAR)
    full = replace(plan, orders=near, template=np.zeros(6, dtype=int))
    compressed = solve(plan, BODIES, tolerance=1e-6)
    elements = solve(full, BODIES, tolerance=1e-5)
    np.testing.assert_allclose(compressed.force, elements.force, atol=24e-5)
    mixed = replace(full, orders=np.where(near[:1] * near[:, :1] == 0, near, plan.orders))
    assert {NEAR} < set(mixed.orders.ravel())
    np.testing.assert_allclose(
        solve(mixed, BODIES, tolerance=1e-5).force, compressed.force, atol=24e-5
    )


def test_error_estimate_bounds_the_error_and_stays_close_to_it():
    neighbours, _ = random_scenes(8, "uniform", range(120), (1e-8, 1e-3))
    for tolerance in (1e-3, 1e-4):
        true, estimated = [], []
        for own in neighbours:
            centres = np.concatenate([np.zeros((1, 3)), own])
            plan = plan_scene(centres, tolerance=tolerance)
            fine = plan_scene(centres, tolerance=1e-7)
            if (fine.orders == NEAR).any():
                continue
            solution = solve(plan, BODIES, tolerance=tolerance)
            exact = solve(fine, BODIES, tolerance=1e-7)
            true.append(np.abs(solution.force[0] - exact.force[0]).max() / 24.0)
            estimated.append(solution.error_estimate)
        true, estimated = np.array(true), np.array(estimated)
        assert len(true) > 100
        assert np.quantile(true, 0.95) < tolerance
        assert np.mean(estimated >= true) >= 0.95
        assert 1.0 < np.median(estimated / np.maximum(true, 1e-12)) < 10.0


def test_gmres_that_runs_out_is_reported_not_hidden(monkeypatch):
    plan = plan_scene(six(2.6))
    monkeypatch.setattr(many_body, "MOST_ITERATIONS", 2)
    solution = solve(plan, BODIES)
    assert solution.status == NOT_CONVERGED
    assert solution.residual > 1e-6
    with pytest.raises(RuntimeError, match="GMRES stopped"):
        forces_on_fixed_spheres(six(2.6))


def test_a_tolerance_out_of_reach_is_said():
    with pytest.warns(RuntimeWarning, match="exceeds the tolerance"):
        forces_on_fixed_spheres(pair(2.01), tolerance=1e-5)


def test_record_tells_the_smallest_gap():
    solution = solve(plan_scene(chain(3.0)), BODIES)
    assert solution.minimum_gap == pytest.approx(0.5)
    assert solution.status == CONVERGED
    assert solve(plan_scene([[0.0, 0.0, 0.0]]), BODIES).minimum_gap == np.inf


@pytest.mark.parametrize(
    ("centres", "message"),
    [
        (np.zeros((2, 2)), "shape"),
        (np.zeros((0, 3)), "shape"),
        ([[0, 0, 0], [np.nan, 0, 0]], "sphere 1 is not finite"),
        ([[0, 0, 0], [5, 0, 0], [5, 0.9, 0]], "spheres 1 and 2 overlap"),
    ],
)
def test_bad_centres_are_refused(centres, message):
    with pytest.raises(ValueError, match=message):
        forces_on_fixed_spheres(centres)


def test_bad_flow_and_tolerance_are_refused():
    with pytest.raises(ValueError, match="three finite numbers"):
        forces_on_fixed_spheres(pair(3.0), flow=[0.0, 1.0])
    with pytest.raises(ValueError, match=r"tolerance 1.*allowed are"):
        forces_on_fixed_spheres(pair(3.0), tolerance=1.0)


def test_no_flow_gives_no_force():
    np.testing.assert_array_equal(forces_on_fixed_spheres(pair(3.0), (0, 0, 0)), np.zeros((2, 3)))
