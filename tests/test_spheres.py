"""What every solver is given is checked in one place, and all of them take a flow alike."""

import numpy as np
import pytest

from dustfall.spheres import (
    centre_distances,
    checked_centres,
    checked_flow,
    checked_tolerance,
    flow_direction,
)
from dustfall.stokes import fixed_spheres, forces_on_fixed_spheres
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres
from dustfall.stokes.references.fundamental_solutions import reference_forces
from dustfall.stokes.references.multiblob import multiblob_forces
from dustfall.suspension.rotne_prager import rotne_prager_forces

FAR = np.array([[0.0, 0.0, 0.0], [0.0, 1e9, 0.0]])

WAYS = {
    "multipole": lambda flow: fixed_spheres(FAR, flow).force,
    "short form": lambda flow: forces_on_fixed_spheres(FAR, flow),
    "exact pair": lambda flow: forces_on_two_spheres(FAR, flow),
    "fundamental solutions": lambda flow: reference_forces(FAR, flow, 1e-4)[0],
    "multiblob": lambda flow: multiblob_forces(FAR, 0, flow),
    "Rotne-Prager": lambda flow: rotne_prager_forces(FAR, flow),
}


@pytest.mark.parametrize("flow", [(0, 2, 0), (0, 1e-90, 0), (0, 1e90, 0)])
@pytest.mark.parametrize("way", WAYS)
def test_an_isolated_sphere_feels_24_in_a_flow_of_any_speed(way, flow):
    np.testing.assert_allclose(WAYS[way](flow), np.tile([0.0, 24.0, 0.0], (2, 1)), atol=24e-5)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("flow", "message"),
    [
        ((0, 1e300, 0), "magnitude must be zero, or 1e-100 to 1e.100"),
        ((0, 1e-300, 0), "magnitude must be zero, or 1e-100 to 1e.100"),
        ((0, np.nan, 0), "three finite numbers"),
        ((0, 1), "three finite numbers"),
        (("a", 1, 0), "flow must be an array of numbers"),
        ((None, 1, 0), "three finite numbers|array of numbers"),
    ],
)
def test_a_flow_that_is_none_is_refused_by_every_solver(way, flow, message):
    with pytest.raises(ValueError, match=message):
        WAYS[way](flow)


@pytest.mark.parametrize(
    ("centres", "message"),
    [
        (np.zeros((2, 2)), "shape"),
        (np.zeros((0, 3)), "shape"),
        (3.0, "shape"),
        ([[0, 0, 0], [np.nan, 0, 0]], "sphere 1 is not finite"),
        ([[0, 0, 0], [1e200, 0, 0]], r"sphere 1 is \[1e\+200.*at most 1e\+100 d_p"),
        ([[0, 0, 0], [5, 0, 0], [5, 0.9, 0]], "spheres 1 and 2 overlap"),
        ([[0, 0, 0], [1, 0, 0]], "overlap or touch"),
        ([[0, 0, 0], [5, 0]], "centres must be an array of numbers"),
        ([[0, 0, "a"]], "centres must be an array of numbers"),
        (None, "shape|array of numbers"),
        ([[0, 0, 1j]], "centres must be an array of numbers"),
    ],
)
def test_bad_centres_are_refused_with_a_sentence(centres, message):
    with pytest.raises(ValueError, match=message):
        checked_centres(centres)


@pytest.mark.parametrize("tolerance", [np.nan, "a", None, 0.0, 1.0, -1e-4, np.inf, [1e-4], 1e-4j])
def test_a_tolerance_that_is_none_is_refused(tolerance):
    with pytest.raises(ValueError, match=r"tolerance .*: allowed are 1e-08 to 0\.1"):
        fixed_spheres(FAR, tolerance=tolerance)


def test_what_is_checked_is_not_changed_by_its_owner_later():
    centres, flow = FAR.copy(), np.array([0.0, 2.0, 0.0])
    kept, stream = checked_centres(centres), checked_flow(flow)
    centres[:], flow[:] = 7.0, 7.0
    np.testing.assert_array_equal(kept, FAR)
    np.testing.assert_array_equal(stream, [0.0, 2.0, 0.0])
    assert checked_tolerance(np.float32(0.5), 0.0, 1.0) == 0.5


def test_arrays_of_any_order_in_memory_meet_the_same_kernels():
    centres = checked_centres(np.asfortranarray(FAR))
    assert centres.flags.c_contiguous
    np.testing.assert_array_equal(centres, FAR)


def test_a_direction_has_length_one_and_no_flow_has_none():
    np.testing.assert_allclose(flow_direction((0, -3e99, 4e99)), [0.0, -0.6, 0.8], rtol=1e-15)
    np.testing.assert_array_equal(flow_direction((0, 0, 0)), np.zeros(3))


def test_distances_are_those_of_centres_and_none_of_a_sphere_to_itself():
    np.testing.assert_array_equal(
        centre_distances(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]])), [[np.inf, 5], [5, np.inf]]
    )
