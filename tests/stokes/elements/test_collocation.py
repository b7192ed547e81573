"""Collocation: the identities of Stokes potentials hold, to the tolerance of the quadrature."""

import numpy as np
import pytest

from dustfall.stokes.elements.collocation import double_layer, elements_of, single_layer
from dustfall.stokes.elements.mesh import sphere_mesh


@pytest.fixture(scope="module")
def mesh():
    return sphere_mesh(0.7)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(("place", "jump"), [(0.5, -1.0), (1.0, -0.5), (1.3, 0.0)])
def test_double_layer_of_a_uniform_velocity_jumps_across_the_surface(mesh, place, jump, tolerance):
    """-u inside, -u/2 on the surface and nothing outside, on the polyhedron itself."""
    elements = elements_of(mesh, True, tolerance)
    uniform = np.tile([0.3, 1.0, -0.2], (len(elements.area), 3, 1))
    potential = double_layer(place * elements.centre, place == 1.0, elements, uniform)
    expected = np.broadcast_to(jump * uniform[0, 0], potential.shape)
    np.testing.assert_allclose(potential, expected, atol=3.0 * tolerance)


def test_double_layer_of_a_rotation_vanishes_outside(mesh):
    """A rigid rotation is linear in space, so the corners carry all of it."""
    elements = elements_of(mesh, True, 1e-7)
    rotation = np.cross([0.3, -1.0, 0.5], elements.corners)
    outside = double_layer(1.2 * elements.centre, False, elements, rotation)
    np.testing.assert_allclose(outside, 0.0, atol=1e-7)


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_single_layer_of_a_pressure_induces_no_velocity(mesh, flat, tolerance):
    elements = elements_of(mesh, flat, tolerance)
    if not flat:
        # A constant traction per element cannot follow the normal of a curved one.
        elements = elements_of(sphere_mesh(0.25), flat, tolerance)
    for place in (0.6, 1.02, 1.5):
        matrix = single_layer(place * elements.centre, False, elements)
        velocity = matrix @ elements.normal.ravel()
        np.testing.assert_allclose(velocity, 0.0, atol=5.0 * tolerance if flat else 2e-3)


@pytest.mark.parametrize("flat", [True, False])
def test_integrals_keep_their_tolerance_at_every_distance(mesh, flat):
    for distance in (1e-4, 1e-2, 0.1, 1.0, 10.0):
        exact, loose = (
            single_layer(e.centre[:5] * (1.0 + distance), False, e)
            for e in (elements_of(mesh, flat, tolerance) for tolerance in (1e-9, 1e-4))
        )
        scale = np.abs(exact).max()
        np.testing.assert_allclose(loose, exact, atol=1e-4 * scale)
        assert not np.array_equal(loose, exact)


def test_single_layer_of_a_uniform_traction_is_uniform_within(mesh):
    """A sphere with traction t/a translates: u = 2 a t / 3 inside (Kim and Karrila 1991)."""
    elements = elements_of(mesh, False, 1e-8)
    matrix = single_layer(0.5 * elements.centre, False, elements)
    velocity = (matrix @ np.tile([0.0, 1.0, 0.0], len(elements.area))).reshape(-1, 3)
    expected = np.broadcast_to([0.0, 2.0 / 3.0, 0.0], velocity.shape)
    np.testing.assert_allclose(velocity, expected, atol=1e-7)
