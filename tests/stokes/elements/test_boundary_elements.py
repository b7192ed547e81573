"""Every rung of the ladder: its error on exact values, and the symmetries of the problem."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dustfall.stokes.elements.boundary_elements import SCHEMES, forces_by_elements
from dustfall.stokes.elements.mesh import SphereMesh, sphere_mesh

FLAT, PROJECTED, LINEAR, QUADRATIC = SCHEMES

# Force / isolated drag on one of two equal spheres at s radii: along, across (Stimson and Jeffery
# 1926; Jeffrey and Onishi 1984).
PAIR = {2.1: (0.650900144515, 0.733131015965), 10.0: (0.870600502898, 0.929865830469)}

# Largest error over the isolated drag with 78 elements a sphere.
BOUND = {FLAT: 5e-2, PROJECTED: 6e-4, LINEAR: 1.5e-3, QUADRATIC: 5e-5}

TRIANGLE = 1.5 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])


@pytest.fixture(scope="module")
def mesh():
    return sphere_mesh(0.7)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("s", PAIR)
def test_two_spheres_feel_the_exact_force_to_the_accuracy_of_the_scheme(mesh, scheme, s):
    centres = [[0.0, 0.0, 0.0], [0.0, s / 2.0, 0.0]]
    for axis, exact in zip((1, 0), PAIR[s], strict=True):
        force = forces_by_elements(centres, mesh, scheme, np.eye(3)[axis]) / 24.0
        np.testing.assert_allclose(force[:, axis], exact, atol=BOUND[scheme])


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_triangle_feels_the_known_force(mesh, scheme):
    force = forces_by_elements(TRIANGLE, mesh, scheme, (0.0, 0.0, 1.0)) / 24.0
    np.testing.assert_allclose(force[:, 2], 0.662821, atol=BOUND[scheme] + 1e-6)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_forces_do_not_depend_on_where_or_how_fast(mesh, scheme):
    here = forces_by_elements(TRIANGLE, mesh, scheme)
    there = forces_by_elements(TRIANGLE + np.array([1e3, -2e3, 5e2]), mesh, scheme, (0.0, 7.0, 0.0))
    np.testing.assert_allclose(there, here, atol=1e-6)


@pytest.mark.parametrize("scheme", [PROJECTED, QUADRATIC])
def test_forces_turn_with_the_scene(mesh, scheme):
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    here = forces_by_elements(TRIANGLE, mesh, scheme)
    there = forces_by_elements(turn.apply(TRIANGLE), mesh, scheme, turn.apply([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(there, turn.apply(here), atol=24.0 * 2.0 * BOUND[scheme])


@pytest.mark.parametrize("scheme", SCHEMES)
def test_forces_and_meshes_turned_together_stay_the_same(mesh, scheme):
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    turned = SphereMesh(turn.apply(mesh.vertices), mesh.triangles)
    here = forces_by_elements(TRIANGLE, mesh, scheme)
    there = forces_by_elements(turn.apply(TRIANGLE), turned, scheme, turn.apply([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(there, turn.apply(here), atol=2e-4)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_each_sphere_may_have_its_own_mesh(mesh, scheme):
    coarse = sphere_mesh(0.9)
    centres = [[0.0, 0.0, 0.0], [0.0, 5.0, 0.0]]
    force = forces_by_elements(centres, [mesh, coarse], scheme)[:, 1] / 24.0
    np.testing.assert_allclose(force, PAIR[10.0][0], atol=2.0 * max(BOUND[scheme], 1e-4))


def test_no_flow_no_force(mesh):
    force = forces_by_elements(TRIANGLE, mesh, PROJECTED, (0.0, 0.0, 0.0))
    np.testing.assert_array_equal(force, np.zeros((3, 3)))


def test_bad_input_is_named(mesh):
    with pytest.raises(ValueError, match="scheme 'cubic'"):
        forces_by_elements(TRIANGLE, mesh, "cubic")
    with pytest.raises(ValueError, match="2 meshes for 3 spheres"):
        forces_by_elements(TRIANGLE, [mesh, mesh], PROJECTED)
    with pytest.raises(ValueError, match="overlap"):
        forces_by_elements(0.5 * TRIANGLE, mesh, PROJECTED)
    with pytest.raises(ValueError, match="flow must be"):
        forces_by_elements(TRIANGLE, mesh, PROJECTED, (0.0, np.nan, 0.0))
