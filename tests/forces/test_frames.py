import numpy as np
import pytest

from dustfall.forces.frames import (
    canonical_frame,
    check_neighbours,
    hold_at_contact,
    lateral_to_canonical_frame,
    lateral_to_flow_frame,
    rotation_to_streamwise,
    sort_by_distance,
    spherical_coordinates,
)
from tests.forces.scenes import random_neighbours


def directions():
    rng = np.random.default_rng(0)
    random = rng.normal(size=(200, 3))
    axis = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    tilts = [
        [sign * tilt * np.cos(angle), end, sign * tilt * np.sin(angle)]
        for end in (1.0, -1.0)
        for sign in (1.0, -1.0)
        for tilt in (1e-3, 1e-7, 1e-8, 1e-12, 1e-16, 1e-200)
        for angle in (0.0, 0.4, np.pi / 2)
    ]
    return np.concatenate([random, axis, np.eye(3), -np.eye(3), np.array(tilts)])


@pytest.mark.parametrize("size", [1e-300, 1e-5, 1.0, 1e300])
def test_rotation_turns_every_velocity_into_the_streamwise_direction(size):
    u = directions()
    R = rotation_to_streamwise(size * u)
    unit = u / np.linalg.norm(u, axis=1, keepdims=True)
    turned = np.einsum("nij,nj->ni", R, unit)
    np.testing.assert_allclose(turned, np.broadcast_to([0, 1, 0], turned.shape), atol=1e-15)


def test_rotation_is_proper_and_orthogonal_for_every_direction():
    R = rotation_to_streamwise(directions())
    product = R @ R.transpose(0, 2, 1)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), R.shape), atol=2e-15)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=2e-15)


def test_rotation_is_the_smallest_one():
    u = directions()
    R = rotation_to_streamwise(u)
    cosine = u[:, 1] / np.linalg.norm(u, axis=1)
    np.testing.assert_allclose(np.trace(R, axis1=1, axis2=2), 1 + 2 * cosine, atol=1e-14)


def test_rotation_of_a_particle_at_rest_is_the_identity():
    np.testing.assert_array_equal(rotation_to_streamwise([0.0, 0.0, 0.0]), np.eye(3))


@pytest.mark.parametrize("velocity", [np.zeros((2, 2)), np.zeros((2, 3, 3)), [np.nan, 0, 1]])
def test_rotation_refuses_what_is_no_velocity(velocity):
    with pytest.raises(ValueError, match="velocity"):
        rotation_to_streamwise(velocity)


def test_spherical_coordinates_have_their_polar_axis_along_z_and_azimuth_from_x_to_y():
    points = np.array([[2.0, 0, 0], [0, 3.0, 0], [0, 0, 4.0], [-1.0, 0, 0], [0, 0, -2.0]])
    expected = np.array(
        [
            [2, 0, np.pi / 2],
            [3, np.pi / 2, np.pi / 2],
            [4, 0, 0],
            [1, np.pi, np.pi / 2],
            [2, 0, np.pi],
        ]
    )
    np.testing.assert_allclose(spherical_coordinates(points), expected, atol=1e-15)


def test_spherical_coordinates_give_the_position_back():
    points = random_neighbours(50)
    r, azimuth, polar = np.moveaxis(spherical_coordinates(points), -1, 0)
    back = np.stack(
        [
            r * np.sin(polar) * np.cos(azimuth),
            r * np.sin(polar) * np.sin(azimuth),
            r * np.cos(polar),
        ],
        axis=-1,
    )
    np.testing.assert_allclose(back, points, rtol=1e-12, atol=1e-12)


def test_sorting_puts_distances_in_order_whatever_the_given_order():
    scenes = random_neighbours(100)
    scenes[0, :] = [[2, 0, 0], [0, 2, 0], [-2, 0, 0], [0, 0, -2], [0, -2, 0]]  # all at one distance
    ordered = sort_by_distance(scenes)
    assert (np.diff(np.linalg.norm(ordered, axis=2), axis=1) >= 0).all()
    shuffled = np.ascontiguousarray(scenes[:, [3, 0, 4, 2, 1]])
    np.testing.assert_array_equal(sort_by_distance(shuffled), ordered)


def test_only_neighbours_closer_than_contact_move_and_only_out_to_contact():
    scenes = random_neighbours(100, nearest=0.2, farthest=10.0)
    distance = np.linalg.norm(scenes, axis=2)
    held = hold_at_contact(scenes)
    assert (distance < 1).any()
    np.testing.assert_array_equal(held[distance >= 1], scenes[distance >= 1])
    close = distance < 1
    np.testing.assert_allclose(held[close], scenes[close] / distance[close, None], rtol=1e-14)


def test_canonical_frame_is_one_and_the_same_for_all_images_of_a_scene():
    scenes = sort_by_distance(random_neighbours(100))
    canonical, _ = canonical_frame(scenes)
    np.testing.assert_allclose(canonical[:, 0, 2], 0, atol=1e-12)
    assert (canonical[:, 0, :2] >= 0).all()
    assert (canonical[:, 1, 2] >= 0).all()
    for image in images(scenes):
        np.testing.assert_allclose(canonical_frame(image)[0], canonical, rtol=1e-12, atol=1e-11)


def test_canonical_frame_decides_where_the_nearest_neighbours_cannot():
    scene = np.array([[[0, 1.5, 0], [2, 0, 0], [0, -2.5, 0], [1, 1, -3], [0, 3, 4]]])
    abreast = np.array([[[1.5, 0, 0], [0, 0, 2.0], [0, -2.5, 0], [1, 1, -3], [0, 3, 4]]])
    for scenes in (scene, abreast):
        canonical, _ = canonical_frame(scenes)
        for image in images(scenes):
            np.testing.assert_allclose(canonical_frame(image)[0], canonical, atol=1e-12)


def test_lateral_force_goes_to_the_canonical_frame_and_back():
    scenes = sort_by_distance(random_neighbours(100))
    _, axes = canonical_frame(scenes)
    lateral = np.random.default_rng(2).normal(size=(100, 2))
    back = lateral_to_flow_frame(lateral_to_canonical_frame(lateral, axes), axes)
    np.testing.assert_allclose(back, lateral, atol=1e-14)


@pytest.mark.parametrize(
    ("neighbours", "message"),
    [
        (np.ones((5, 3)), r"shape \(5, 3\)"),
        (np.ones((2, 5, 2)), r"shape \(2, 5, 2\)"),
        (np.ones((2, 0, 3)), r"shape \(2, 0, 3\).*k from 1 to 50"),
        (np.ones((2, 51, 3)), r"shape \(2, 51, 3\).*k from 1 to 50"),
        (np.full((2, 5, 3), np.nan), "scene 0 .* not finite"),
        (np.full((2, 5, 3), np.inf), "not finite"),
        (np.full((2, 5, 3), 1e160), "beyond 1e"),
        (np.zeros((1, 5, 3)), "centre of the reference sphere"),
    ],
)
def test_neighbours_that_are_none_are_refused(neighbours, message):
    with pytest.raises(ValueError, match=message):
        check_neighbours(neighbours)


def images(scenes):
    """The scenes turned about the flow axis, mirrored through it, inverted, and all of these."""
    turn = 0.7
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    mirror = np.diag([-1.0, 1.0, 1.0])
    return [
        np.ascontiguousarray(scenes @ matrix.T)
        for matrix in (rotation, mirror, -np.eye(3), -rotation @ mirror)
    ]
