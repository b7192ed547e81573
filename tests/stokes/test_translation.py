"""The coupling of two spheres in harmonics is the integral that it stands for."""

import numpy as np
import pytest
from scipy.integrate import lebedev_rule

from dustfall.stokes.harmonics import real_harmonics
from dustfall.stokes.multipoles import _add_first_moments, _add_pair
from dustfall.stokes.translation import (
    axial_coupling,
    block_sizes,
    gather_azimuthal,
    put_coupling_of_forces,
    scatter_azimuthal,
    translation_tables,
    turn_from_axis,
    turn_to_axis,
    turns_to,
)

TABLES = translation_tables()
RNG = np.random.default_rng(4)


def coupled(degree, shift, at_i, at_j, radii=(1.0, 1.0)):
    """Velocities on spheres i and j, i at `shift` from j, by the tractions on the other."""
    distance = np.linalg.norm(shift)
    k = (degree + 1) ** 2
    u_i, u_j = np.zeros((k, 3)), np.zeros((k, 3))
    turns = turns_to(degree, shift / distance)
    coupling = axial_coupling(degree, distance, radii, TABLES)
    field, spare, lines = np.empty((k, 3)), np.empty((k, 3)), np.empty((4, 3 * k, 2))
    _add_pair(degree, False, turns, coupling, TABLES, at_i, at_j, u_i, u_j, field, spare, lines)
    return u_i, u_j


def integrated(degree, shift, traction, radii=(1.0, 1.0)):
    """Harmonics of the velocity on a sphere at `shift`, by quadrature on both spheres.

    radii: of that sphere and of the one that the traction is on, whose moments are given.
    """
    points, weights = lebedev_rule(77)
    points = points.T
    harmonics = real_harmonics(degree, points)
    loads = weights[:, None] * (harmonics @ traction)
    velocity = np.empty((len(points), 3))
    for p, x in enumerate(points):
        apart = shift + radii[0] * x - radii[1] * points
        r = np.linalg.norm(apart, axis=1)
        velocity[p] = loads.T @ (1.0 / r) + apart.T @ (np.sum(apart * loads, axis=1) / r**3)
    return harmonics.T @ (weights[:, None] * velocity) / (8.0 * np.pi)


@pytest.mark.parametrize(
    "shift", [[1.1, -1.7, 1.9], [0.0, 0.0, 2.6], [0.0, 0.0, -2.6], [-3.0, 0.0, 0.0], [0, 9.0, 2.0]]
)
@pytest.mark.parametrize("degree", [0, 1, 6])
def test_coupling_is_the_integral_over_both_spheres(degree, shift):
    shift = np.array(shift, dtype=float)
    tractions = RNG.normal(size=(2, (degree + 1) ** 2, 3))
    u_i, u_j = coupled(degree, shift, *tractions)
    np.testing.assert_allclose(u_i, integrated(degree, shift, tractions[1]), atol=1e-13)
    np.testing.assert_allclose(u_j, integrated(degree, -shift, tractions[0]), atol=1e-13)


@pytest.mark.parametrize("radii", [(0.5, 1.2), (1.5, 0.1)])
@pytest.mark.parametrize("degree", [0, 1, 6])
def test_coupling_of_unequal_spheres_is_the_integral_over_both(degree, radii):
    shift = np.array([1.1, -1.7, 1.9])
    tractions = RNG.normal(size=(2, (degree + 1) ** 2, 3))
    u_i, u_j = coupled(degree, shift, *tractions, radii)
    np.testing.assert_allclose(u_i, integrated(degree, shift, tractions[1], radii), atol=1e-13)
    from_i = integrated(degree, -shift, tractions[0], radii[::-1])
    np.testing.assert_allclose(u_j, from_i, atol=1e-13)


@pytest.mark.parametrize("degree", [3, 20, 40])
def test_coupling_is_reciprocal(degree):
    """Lorentz: the power of either traction in the other's flow is the same."""
    one, other = RNG.normal(size=(2, (degree + 1) ** 2, 3))
    shift = np.array([0.9, 1.2, -1.5])
    u_i, u_j = coupled(degree, shift, one, other)
    # Seen from the other side, with the spheres' names exchanged.
    v_j, v_i = coupled(degree, -shift, other, one)
    np.testing.assert_allclose(np.sum(one * u_i), np.sum(other * u_j), rtol=1e-11)
    scale = np.abs(u_i).max()
    np.testing.assert_allclose(v_i, u_i, atol=1e-11 * scale)
    np.testing.assert_allclose(v_j, u_j, atol=1e-11 * scale)


@pytest.mark.parametrize("degree", [0, 2, 11, 40])
def test_turning_there_and_back_changes_nothing(degree):
    field = RNG.normal(size=((degree + 1) ** 2, 3))
    turned, spare = field.copy(), np.empty_like(field)
    turns = turns_to(degree, np.array([-0.48, -0.6, 0.64]))
    turn_to_axis(degree, turns, TABLES, turned, spare)
    np.testing.assert_allclose(np.sum(turned**2), np.sum(field**2), rtol=1e-12)
    turn_from_axis(degree, turns, TABLES, turned, spare)
    np.testing.assert_allclose(turned, field, atol=1e-11)


def test_turned_field_is_the_field_seen_in_turned_axes():
    degree, polar, azimuth = 4, 0.8, 2.3
    field = RNG.normal(size=((degree + 1) ** 2, 3))
    turned = field.copy()
    c, s, C, S = np.cos(polar), np.sin(polar), np.cos(azimuth), np.sin(azimuth)
    turns = turns_to(degree, np.array([s * C, s * S, c]))
    turn_to_axis(degree, turns, TABLES, turned, np.empty_like(field))
    axes = np.array([[c * C, c * S, -s], [-S, C, 0.0], [s * C, s * S, c]])
    points = lebedev_rule(9)[0].T
    seen = real_harmonics(degree, points @ axes.T) @ turned
    np.testing.assert_allclose(seen, (real_harmonics(degree, points) @ field) @ axes.T, atol=1e-12)


@pytest.mark.parametrize("degree", [0, 1, 5])
def test_azimuthal_numbers_hold_the_whole_field(degree):
    field = RNG.normal(size=((degree + 1) ** 2, 3))
    values, again = np.zeros((block_sizes(degree)[0].sum(), 2)), np.empty_like(field)
    gather_azimuthal(degree, field, values)
    scatter_azimuthal(degree, values, again)
    np.testing.assert_allclose(again, field, atol=1e-14)


@pytest.mark.parametrize("direction", [[0, 0, 1], [0, 0, -1], [-0.6, 0, 0.8], [0.48, -0.6, -0.64]])
def test_turns_are_the_angles_of_their_direction(direction):
    polar, azimuth = np.arccos(direction[2]), np.arctan2(direction[1], direction[0])
    m = np.arange(41 + 1)
    expected = [np.cos(m * azimuth), np.sin(m * azimuth), np.cos(m * polar), np.sin(m * polar)]
    np.testing.assert_allclose(turns_to(40, np.array(direction, float)), expected, atol=1e-13)


def test_coupling_of_forces_is_that_of_degree_zero():
    shift = np.array([1.1, -1.7, 1.9])
    forces = RNG.normal(size=(2, 1, 3))
    u_i, u_j = coupled(0, shift, *forces)
    tensor = np.empty(9)
    put_coupling_of_forces(shift, np.zeros(3), (1.0, 1.0), tensor)
    tensor = tensor.reshape(3, 3)
    np.testing.assert_allclose(tensor @ forces[1, 0], u_i[0], rtol=1e-13)
    np.testing.assert_allclose(tensor @ forces[0, 0], u_j[0], rtol=1e-13)


@pytest.mark.parametrize("radii", [(1.0, 1.0), (0.5, 1.3)])
def test_coupling_of_first_moments_is_that_of_degree_one(radii):
    shift = np.array([1.1, -1.7, 1.9])
    moments = RNG.normal(size=(2, 4, 3))
    expected = coupled(1, shift, *moments, radii)
    found = np.zeros((2, 4, 3))
    a, b = radii[0] ** 2, radii[1] ** 2
    _add_first_moments(*shift, (a, b), moments[1], found[0])
    _add_first_moments(*-shift, (b, a), moments[0], found[1])
    np.testing.assert_allclose(found, expected, atol=1e-14)
