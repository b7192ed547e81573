"""Fixed spheres in a uniform Stokes flow by boundary elements on gmsh meshes, with an error estimate.

A scene is solved on two levels of meshes. Every part of a level is coarser than that of the next:
elements, grading, quadrature, the points through which far spheres meet. So the difference of
the forces says how wrong the coarser level is, and bounds the error of the finer one.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, gmres

from dustfall.spheres import centre_distances
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.near_pairs import near_coupling, side
from dustfall.stokes.elements.single_layer import put_block, stokeslet
from dustfall.stokes.elements.templates import (
    MOST_DEGREE,
    Exchange,
    Level,
    Template,
    gradings_for,
    template_facing,
)
from dustfall.units import FORCE_UNIT, RADIUS

MOST_ITERATIONS = 300

SHARE = 0.1
"""Part of a level's accuracy that the quadrature of near pairs, and the exchange of far ones, may
spend."""


@dataclass(frozen=True, eq=False)
class MeshedSphere:
    """One sphere of a scene: a template, where it is and how it is turned.

    centre: (3,) [d_p]. turn: (3, 3) rotation of the template. exchange: how it meets far spheres.
    """

    template: Template
    centre: np.ndarray
    turn: np.ndarray
    exchange: Exchange

    def points(self) -> np.ndarray:
        """Points of the exchange [d_p], (p, 3)."""
        return self.centre + RADIUS * self.exchange.points @ self.turn.T

    def mesh(self) -> SphereMesh:
        """The mesh of the unit sphere as it is turned."""
        mesh = self.template.mesh
        return SphereMesh(mesh.vertices @ self.turn.T, mesh.triangles)

    def loads(self, velocity) -> np.ndarray:
        """Loads of the nodes (n, 3), seen by the template, by velocities at the points (p, 3)."""
        return self.exchange.spread @ (velocity @ self.turn)

    def forces(self, traction) -> np.ndarray:
        """Forces at the points (p, 3) by tractions of the nodes (n, 3), seen by the template."""
        return (self.exchange.spread.T @ traction) @ self.turn.T


class LoneSphere:
    """A sphere without near neighbours: its answer is its template's."""

    def __init__(self, sphere: MeshedSphere):
        self.sphere = sphere

    def forces(self, velocity) -> np.ndarray:
        """Forces at the points by velocities there, (p, 3) each."""
        response, turn = self.sphere.exchange.response, self.sphere.turn
        return (response @ (velocity @ turn).ravel()).reshape(-1, 3) @ turn.T

    def tractions(self, velocity) -> list[np.ndarray]:
        """Tractions of the nodes, seen by the template."""
        load = self.sphere.loads(velocity).ravel()
        return [(self.sphere.template.inverse @ load).reshape(-1, 3)]


class Cluster:
    """Spheres that are near to each other, solved as one body.

    Its matrix has the templates' own on the diagonal and the near pairs' beside it.
    """

    def __init__(self, spheres: list[MeshedSphere], near, level: Level):
        self.spheres = spheres
        ends = np.cumsum([0] + [len(sphere.template.matrix) for sphere in spheres])
        matrix = np.zeros((ends[-1], ends[-1]))
        for i, sphere in enumerate(spheres):
            matrix[ends[i] : ends[i + 1], ends[i] : ends[i + 1]] = sphere.template.matrix
            for j in np.flatnonzero(near[i, :i]):
                # cho_factor reads the lower half alone.
                matrix[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] = _near_block(
                    sphere, spheres[j], level
                )
        self._ends = ends[1:-1] // 3
        self._point_ends = np.cumsum([len(sphere.exchange.points) for sphere in spheres])[:-1]
        self._factor = cho_factor(matrix, lower=True, overwrite_a=True, check_finite=False)

    def tractions(self, velocity) -> list[np.ndarray]:
        """Tractions of the nodes of each sphere, seen by its template."""
        own = np.split(velocity, self._point_ends)
        pairs = zip(self.spheres, own, strict=True)
        load = np.concatenate([sphere.loads(u) for sphere, u in pairs])
        traction = cho_solve(self._factor, load.ravel(), check_finite=False)
        return np.split(traction.reshape(-1, 3), self._ends)

    def forces(self, velocity) -> np.ndarray:
        """Forces at the points of all spheres by velocities there, (p, 3) each."""
        pairs = zip(self.spheres, self.tractions(velocity), strict=True)
        return np.concatenate([sphere.forces(f) for sphere, f in pairs])


def _near_block(target: MeshedSphere, source: MeshedSphere, level: Level) -> np.ndarray:
    """Loads of one sphere by the tractions of another, both as seen by their templates."""
    shift = target.centre - source.centre
    gap = (np.linalg.norm(shift) - 1.0) / RADIUS
    # Near spheres amplify by 1 / gap what they do not feel alike.
    tolerance = SHARE * level.accuracy * min(1.0, gap)
    block = near_coupling(side(target.mesh(), tolerance), side(source.mesh(), tolerance), shift)
    rows, columns = block.shape
    block = target.turn.T @ block.reshape(rows // 3, 3, columns)
    return (block.reshape(-1, 3) @ source.turn).reshape(rows, columns)


def mesh_scene(centres, level: Level):
    """Choose, and where needed make, the mesh of every sphere.

    centres: (n, 3) [d_p]. Returns the spheres and which pairs are near, (n, n).
    """
    distance = centre_distances(centres)
    gap = distance - 1.0
    degrees = _exchange_degrees(distance, level.accuracy)
    near = (degrees > MOST_DEGREE) & np.isfinite(distance)
    spheres = []
    for i in range(len(centres)):
        close = np.flatnonzero(near[i])
        directions = (centres[close] - centres[i]) / distance[i, close, None]
        template, turn = template_facing(level, directions, gradings_for(gap[i, close]))
        degree = int(np.where(near[i], 1, degrees[i]).max())
        spheres.append(MeshedSphere(template, centres[i], turn, template.exchange(degree)))
    return spheres, near


def _exchange_degrees(distance, accuracy) -> np.ndarray:
    """Degree (n, n) that each pair has to exchange.

    Harmonics of degree l fall off as exp(-xi l) from one sphere to another, cosh(xi) = distance /
    d_p (Stimson and Jeffery 1926), once where a third sphere, or the other, excites them and once
    where they are felt. A near pair multiplies what reaches it by about 1 / gap.
    """
    n = len(distance)
    xi = np.arccosh(distance)
    nearest = xi.min(axis=1)
    excited = np.minimum(nearest[:, None], nearest[None, :])
    goal = SHARE * accuracy * min(1.0, (distance.min() - 1.0) / RADIUS)
    degrees = np.zeros((n, n))
    apart = ~np.eye(n, dtype=bool)
    degrees[apart] = np.ceil(np.log(1.0 / goal) / (xi + excited)[apart] - 1.0)
    return np.maximum(degrees, 1.0)


@njit(cache=True)
def _point_coupling(points, owner, near):
    """(1 / 8 pi) G between points of different spheres that are not near, (3p, 3p), symmetric."""
    count = len(points)
    matrix = np.zeros((3 * count, 3 * count))
    g = np.empty(6)
    for p in range(count):
        for q in range(p):
            if owner[p] != owner[q] and not near[owner[p], owner[q]]:
                x, y, z = points[p] - points[q]
                stokeslet(x, y, z, g)
                g /= 8.0 * np.pi
                put_block(matrix, p, q, g)
                put_block(matrix, q, p, g)
    return matrix


@dataclass(frozen=True, eq=False)
class SceneSolution:
    """A scene solved on one level of meshes.

    force: (n, 3) [Re_p c_D]. spheres: as meshed. traction: for each sphere (nodes, 3), at the
    vertices and then at the middles of the edges of its mesh [mu U / d_p], up to a pressure inside
    each sphere that nothing determines. residual: relative, of the preconditioned system.
    """

    force: np.ndarray
    spheres: list[MeshedSphere]
    traction: list[np.ndarray]
    iterations: int
    residual: float


def solve_on_meshes(centres, flow, level: Level, goal: float) -> SceneSolution:
    """Solve a scene on one level; centres (n, 3) [d_p], flow (3,) of length 1, goal of GMRES.

    Unknown are the forces at the points of all spheres: forces = answer(flow - coupling forces).
    """
    spheres, near = mesh_scene(centres, level)
    _, cluster = connected_components(near, directed=False)
    # Spheres of a cluster stand side by side.
    order = np.argsort(cluster, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(cluster))[:-1])
    bodies = [
        Cluster([spheres[i] for i in own], near[np.ix_(own, own)], level)
        if len(own) > 1
        else LoneSphere(spheres[own[0]])
        for own in members
    ]
    points = [spheres[i].points() for i in order]
    owner = np.repeat(order, [len(own) for own in points])
    coupling = _point_coupling(np.concatenate(points), owner, near)
    ends = np.cumsum([sum(len(spheres[i].exchange.points) for i in own) for own in members])[:-1]

    def answer(velocity):
        parts = zip(bodies, np.split(velocity, ends), strict=True)
        return np.concatenate([body.forces(u) for body, u in parts]).ravel()

    def system(forces):
        return forces + answer((coupling @ forces).reshape(-1, 3))

    undisturbed = np.tile(flow, (len(owner), 1))
    right = answer(undisturbed)
    forces, residuals = right, []
    if len(bodies) > 1:
        operator = LinearOperator((len(right), len(right)), matvec=system, dtype=float)
        forces, _ = gmres(
            operator, right, rtol=goal, restart=MOST_ITERATIONS, maxiter=1,
            callback=residuals.append, callback_type="pr_norm",
        )  # fmt: skip
    velocity = np.split(undisturbed - (coupling @ forces).reshape(-1, 3), ends)
    traction = [np.empty(0)] * len(spheres)
    for own, body, u in zip(members, bodies, velocity, strict=True):
        for i, f in zip(own, body.tractions(u), strict=True):
            traction[i] = f @ spheres[i].turn.T
    force = np.zeros((len(spheres), 3))
    np.add.at(force, owner, FORCE_UNIT * forces.reshape(-1, 3))
    residual = float(residuals[-1]) if residuals else 0.0
    return SceneSolution(force, spheres, traction, len(residuals), residual)
