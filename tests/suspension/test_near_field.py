"""Close pairs resist relative motion as exact solutions say, and nothing else changes."""

import numpy as np
import pytest

from dustfall.stokes.references.exact_pairs import pair_drag
from dustfall.suspension.near_field import (
    REACH,
    SMALLEST_GAP,
    NearField,
    approach_resistance,
    relative_resistance,
)
from dustfall.suspension.rotne_prager import pair_coefficients

SIDE = 20.0


def close_pairs(position, way=None, stiff=1e4):
    way = np.zeros_like(position) if way is None else way
    return NearField(position, SIDE, way, stiff)


@pytest.mark.parametrize(
    ("gap", "expected"),
    [(0.5, 2.038655), (0.05, 7.413298), (0.01, 28.114022), (0.001, 254.143204)],
)
def test_spheres_approach_as_brenner_found(gap, expected):
    assert approach_resistance(gap) == pytest.approx(expected, abs=1e-6)


def test_resistance_to_approach_goes_over_into_lubrication():
    # Jeffrey & Onishi 1984: 1 / (2 s) - 9/20 ln(s) and a constant, for a gap of s radii.
    one, other = approach_resistance(1e-4), approach_resistance(5e-5)
    expected = 1 / (4 * 1e-4) + 9 / 20 * np.log(2)
    assert other - one == pytest.approx(expected, rel=1e-4)


def test_what_rotne_prager_lacks_dies_out_and_is_never_negative():
    _, lacking = relative_resistance()
    assert (np.diff(lacking, axis=0) < 0).all()
    assert (lacking > 0).all()
    assert (lacking[-1] < 0.013).all()
    # Across, it is bounded: spheres that turn freely roll past each other.
    assert lacking[0, 1] < 0.4


def test_a_pair_in_relative_motion_has_the_exact_resistance():
    for distance in (1.05, 1.4, 2.0):
        position = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, distance]])
        velocity = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
        force = close_pairs(position).forces(velocity)
        across, along = pair_coefficients(distance)
        total = force[0, 2] + 1 / (1 - across - along)
        assert total == pytest.approx(approach_resistance(distance - 1), rel=1e-4)


def test_a_pair_that_moves_as_one_keeps_rotne_pragers_drag():
    position = np.array([[1.0, 2.0, 3.0], [1.7, 2.8, 3.2]])
    np.testing.assert_array_equal(close_pairs(position).forces(np.ones((2, 3))), 0.0)
    # Which is the exact one within a few per cent down to contact.
    across, along = pair_coefficients(1.0001)
    exact = pair_drag(1.0001)
    assert 1 / (1 + across + along) == pytest.approx(exact[0], rel=0.05)
    assert 1 / (1 + across) == pytest.approx(exact[1], rel=0.05)


def test_forces_are_symmetric_positive_and_sum_to_zero():
    rng = np.random.default_rng(1)
    near = close_pairs(rng.uniform(0, 6, (30, 3)))
    one, other = rng.normal(size=(2, 30, 3))
    assert np.vdot(one, near.forces(other)) == pytest.approx(np.vdot(other, near.forces(one)))
    assert np.vdot(one, near.forces(one)) > 0
    np.testing.assert_allclose(near.forces(one).sum(axis=0), 0.0, atol=1e-9)
    relaxed = near.relaxed(one, 0.1)
    np.testing.assert_allclose(relaxed + 0.1 * near.forces(relaxed), one, atol=1e-6)


def test_pairs_meet_across_the_faces_of_the_cube():
    position = np.array([[0.2, 5.0, 5.0], [SIDE - 0.9, 5.0, 5.0]])
    velocity = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    inside = position + np.array([7.0, 1.0, 1.0])
    np.testing.assert_allclose(
        close_pairs(position).forces(velocity), close_pairs(inside).forces(velocity), rtol=1e-9
    )


def test_pairs_that_would_touch_are_stopped_and_those_that_pass_are_not():
    position = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 9.0, 0.0], [2.0, 10.2, 0.0]])
    way = np.array([[0.6, 0.0, 0.0], [-0.6, 0.0, 0.0], [0.6, 0.0, 0.0], [-0.6, 0.0, 0.0]])
    near = close_pairs(position, way)
    assert near.stopped == 1
    after = near.relaxed(way, 1.0)
    np.testing.assert_allclose(after[:2], 0.0, atol=1e-3)
    assert np.abs(after[2:]).min(axis=0)[0] > 0.3
    assert close_pairs(position, -way).stopped == 0


def test_spheres_below_the_smallest_gap_resist_as_at_it_and_overlaps_are_counted():
    velocity = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    forces = []
    for distance, overlapping in ((1 + SMALLEST_GAP, 0), (0.9, 1)):
        near = close_pairs(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, distance]]))
        assert near.overlapping == overlapping
        forces.append(near.forces(velocity))
    np.testing.assert_allclose(*forces, rtol=1e-9)


def test_a_cube_in_which_a_sphere_is_close_to_its_own_image_is_refused():
    with pytest.raises(ValueError, match=r"side of the cube is 5\.0: more than 5\.0"):
        NearField(np.zeros((1, 3)), 2 * REACH, np.zeros((1, 3)), 1.0)
