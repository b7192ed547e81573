"""The templates are closed, outward and exactly spherical."""

import numpy as np
import pytest

from dustfall.stokes.elements.mesh import sphere_mesh

TOWARD = np.array([[0.0, 0.0, 2.0], [0.5, -1.0, 0.3]])


def solid_angles(mesh):
    """Solid angle of each element [sr] (van Oosterom and Strackee 1983)."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    triple = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = sum(np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a)))
    return 2.0 * np.arctan2(triple, 1.0 + dots)


@pytest.fixture(params=[(1.0,), (0.5,), (0.3,), (0.8, TOWARD, 0.05)], scope="module")
def mesh(request):
    return sphere_mesh(*request.param)


def test_surface_is_closed_and_simple(mesh):
    sides = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert (count == 2).all()
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.triangles) == 2


def test_elements_cover_the_sphere_once_and_face_outward(mesh):
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1.0, rtol=1e-15)
    angles = solid_angles(mesh)
    assert angles.min() > 0.0
    assert angles.sum() == pytest.approx(4.0 * np.pi, rel=1e-13)


def test_edges_have_the_length_asked_for():
    for size in (0.7, 0.35):
        mesh = sphere_mesh(size)
        length = np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1)[:, 0], axis=1)
        assert 0.75 * size < np.median(length) < 1.25 * size


def test_edges_shrink_towards_the_directions_given_and_nowhere_else():
    mesh = sphere_mesh(0.8, TOWARD, 0.05)
    ends = mesh.vertices[mesh.edges]
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    for direction in TOWARD / np.linalg.norm(TOWARD, axis=1, keepdims=True):
        away = np.linalg.norm(ends.mean(axis=1) - direction, axis=1)
        assert 0.03 < np.median(length[away < 0.06]) < 0.1
    assert length.max() > 0.5
    assert len(mesh.triangles) < 400


def test_a_graded_mesh_leaves_the_next_one_uniform():
    before = sphere_mesh(0.5)
    sphere_mesh(0.8, TOWARD, 0.05)
    np.testing.assert_array_equal(sphere_mesh(0.5).vertices, before.vertices)


def test_same_size_gives_the_same_mesh():
    one, other = sphere_mesh(0.5), sphere_mesh(0.5)
    np.testing.assert_array_equal(one.vertices, other.vertices)
    np.testing.assert_array_equal(one.triangles, other.triangles)


@pytest.mark.parametrize("size", [0.0, -1.0, 2.0, np.nan])
def test_impossible_edge_length_is_refused(size):
    with pytest.raises(ValueError, match="edge length"):
        sphere_mesh(size)
    with pytest.raises(ValueError, match="edge length"):
        sphere_mesh(0.5, TOWARD, -0.1)
