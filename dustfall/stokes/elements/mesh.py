"""Triangular surface meshes of a sphere, made by gmsh. They know nothing of physics."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dustfall.extras import extra

with extra("mesh"):
    import gmsh

LARGEST_SIZE = 1.5
"""Longest edges [radii] that still make a closed, convex mesh."""


@dataclass(frozen=True, eq=False)
class SphereMesh:
    """Triangles whose vertices lie on the unit sphere.

    vertices: (n_vertices, 3), unit vectors. triangles: (n_triangles, 3), vertex numbers,
    anticlockwise seen from outside. An element is the radial projection of the flat triangle
    onto the sphere, so the geometry is exact at every mesh size.
    """

    vertices: np.ndarray
    triangles: np.ndarray

    @cached_property
    def edges(self) -> np.ndarray:
        """(n_edges, 2) vertex numbers, each edge once, the lower number first."""
        return self._edges_and_sides[0]

    @cached_property
    def quadratic_nodes(self) -> np.ndarray:
        """(n_triangles, 6) nodes of each element: its vertices, then the middles of 01, 12, 20."""
        return np.column_stack([self.triangles, len(self.vertices) + self._edges_and_sides[1]])

    @cached_property
    def _edges_and_sides(self):
        """Edges, and the number of the edge on each side of each triangle."""
        sides = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        edges, numbers = np.unique(sides, axis=0, return_inverse=True)
        return edges, numbers.reshape(-1, 3)


GROWTH = 0.5
"""Edge length gained per distance from the point that a graded mesh refines towards."""


@contextmanager
def gmsh_session(name: str) -> Iterator[str]:
    """A gmsh model of this name, gone at the end; a session of the caller's goes on as it was."""
    already_running = gmsh.isInitialized()
    if not already_running:
        gmsh.initialize(interruptible=False)
    model_before = gmsh.model.getCurrent()
    gmsh.option.setNumber("General.Verbosity", 2)
    gmsh.model.add(name)
    try:
        yield name
    finally:
        gmsh.model.remove()
        if already_running:
            gmsh.model.setCurrent(model_before)
        else:
            gmsh.finalize()


def sphere_mesh(size: float, toward=(), finest=LARGEST_SIZE) -> SphereMesh:
    """Mesh the unit sphere with gmsh; `size` is the edge length [radii].

    toward: (k, 3) directions in which edges shrink to `finest` [radii], one length or (k,), for
    spheres that nearly touch there: the traction varies over sqrt(gap * radius), and edges should
    be of this order. Raises ValueError unless 0 < size <= LARGEST_SIZE and finest is above 0.
    """
    finest = np.broadcast_to(np.asarray(finest, dtype=float), len(toward))
    if not (finest > 0.0).all():
        raise ValueError(f"finest edge lengths {finest.tolist()} radii: they must be above 0")
    if not 0.0 < size <= LARGEST_SIZE:
        raise ValueError(f"edge length {size} radii: it must lie in (0, {LARGEST_SIZE}]")

    with gmsh_session("sphere"):
        gmsh.model.occ.addSphere(0.0, 0.0, 0.0, 1.0)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", min([size, *finest]))
        for source in ("ExtendFromBoundary", "FromPoints"):
            gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0 if len(toward) else 1)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        if len(toward):
            _grade(toward, finest)
        gmsh.model.mesh.generate(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(
            gmsh.model.mesh.getElementType("triangle", 1)
        )

    vertices = coordinates.reshape(-1, 3)
    position = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    position[tags.astype(np.int64)] = np.arange(len(tags))
    triangles = position[corners.astype(np.int64)].reshape(-1, 3)
    used, triangles = np.unique(triangles, return_inverse=True)
    vertices = vertices[used] / np.linalg.norm(vertices[used], axis=1, keepdims=True)
    triangles = triangles.reshape(-1, 3)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", a, np.cross(b, c)) < 0.0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return SphereMesh(vertices, triangles)


def _grade(toward, finest):
    """Set the edge length that grows from `finest` with the distance from points of the sphere."""
    toward = np.array(toward, dtype=float)
    add = gmsh.model.mesh.field.add
    fields = []
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    for (x, y, z), shortest in zip(toward, finest, strict=True):
        field = add("MathEval")
        distance = f"sqrt((x-({x}))^2+(y-({y}))^2+(z-({z}))^2)"
        gmsh.model.mesh.field.setString(field, "F", f"{shortest}+{GROWTH}*{distance}")
        fields.append(field)
    smallest = add("Min")
    gmsh.model.mesh.field.setNumbers(smallest, "FieldsList", fields)
    gmsh.model.mesh.field.setAsBackgroundMesh(smallest)
