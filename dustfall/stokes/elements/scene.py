"""Fixed spheres in a uniform Stokes flow by boundary elements on gmsh meshes, with an error estimate.

A scene is solved on two levels of meshes. Every part of a level is coarser than that of the next:
elements, grading, quadrature, the points through which far spheres meet. So the difference of
the forces says how wrong the coarser level is, and bounds the error of the finer one.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.sparse.linalg import LinearOperator, gmres

from dustfall.spheres import centre_distances, checked_centres, checked_flow
from dustfall.stokes.elements.near_pairs import near_coupling, side
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.single_layer import put_block, stokeslet
from dustfall.stokes.elements.templates import (
    LEVELS,
    MOST_DEGREE,
    Exchange,
    Level,
    Template,
    gradings_for,
    template_facing,
)
from dustfall.units import FORCE_UNIT, RADIUS, STOKES_DRAG

MOST_ITERATIONS = 300

SHARE = 0.1
"""Part of a level's accuracy that the quadrature of near pairs, and the exchange of far ones, may
spend."""


@dataclass(frozen=True, eq=False)
class MeshedSphere:
    """One sphere of a scene: a template, where it is and how it is turned.

    centre: (3,) [d_p]. turn: (3, 3) rotation of the template. exchange: how it meets far spheres.
    near: whether another sphere is integrated with it element by element.
    """

    template: Template
    centre: np.ndarray
    turn: np.ndarray
    exchange: Exchange
    near: bool

    @property
    def unknowns(self) -> int:
        """Tractions at the nodes if the sphere has near neighbours, else forces at the points."""
        return len(self.exchange.spread) if self.near else len(self.exchange.points)

    def points(self) -> np.ndarray:
        """Points of the exchange [d_p], (p, 3)."""
        return self.centre + RADIUS * self.exchange.points @ self.turn.T

    def answer(self, matrix, load) -> np.ndarray:
        """A matrix of the template applied to vectors (k, 3) of the scene."""
        return (matrix @ (load @ self.turn).ravel()).reshape(-1, 3) @ self.turn.T


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
        degree = int(np.where(near[i], 0, degrees[i]).max())
        spheres.append(
            MeshedSphere(template, centres[i], turn, template.exchange(degree), len(close) > 0)
        )
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
    """Solve a scene on one level; centres (n, 3) [d_p], flow (3,) of length 1, goal of GMRES."""
    spheres, near = mesh_scene(centres, level)
    count = [len(sphere.exchange.points) for sphere in spheres]
    points = np.concatenate([sphere.points() for sphere in spheres])
    coupling = _point_coupling(points, np.repeat(np.arange(len(spheres)), count), near)
    blocks = _near_blocks(spheres, near, level)
    point_ends = np.cumsum(count)[:-1]
    ends = np.cumsum([sphere.unknowns for sphere in spheres])[:-1]

    def tractions(velocity, loads):
        """Unknowns of each sphere in a flow given at its points and, if near, at its nodes."""
        out = []
        for sphere, u, load in zip(spheres, velocity, loads, strict=True):
            if sphere.near:
                load = load + sphere.exchange.spread @ u
                out.append(sphere.answer(sphere.template.inverse, load))
            else:
                out.append(sphere.answer(sphere.exchange.response, u))
        return out

    def forces_at_points(unknowns):
        return [
            sphere.exchange.spread.T @ f if sphere.near else f
            for sphere, f in zip(spheres, unknowns, strict=True)
        ]

    def induced(unknowns):
        """Velocities at points and loads at nodes that the other spheres' tractions induce."""
        forces = np.concatenate(forces_at_points(unknowns))
        velocity = np.split((coupling @ forces.ravel()).reshape(-1, 3), point_ends)
        loads = [np.zeros((len(sphere.exchange.spread), 3)) for sphere in spheres]
        for (i, j), block in blocks.items():
            loads[i] += (block @ unknowns[j].ravel()).reshape(-1, 3)
        return velocity, loads

    def system(x):
        unknowns = np.split(x.reshape(-1, 3), ends)
        return x + np.concatenate(tractions(*induced(unknowns))).ravel()

    undisturbed = [np.tile(flow, (n, 1)) for n in count]
    right = np.concatenate(tractions(undisturbed, np.zeros(len(spheres)))).ravel()
    solution, residuals = right, []
    if len(spheres) > 1:
        operator = LinearOperator((len(right), len(right)), matvec=system, dtype=float)
        solution, _ = gmres(
            operator, right, rtol=goal, restart=MOST_ITERATIONS, maxiter=1,
            callback=residuals.append, callback_type="pr_norm",
        )  # fmt: skip
    unknowns = np.split(solution.reshape(-1, 3), ends)
    velocity, _ = induced(unknowns)
    traction = [
        f if sphere.near else sphere.answer(
            sphere.template.inverse, sphere.exchange.spread @ (flow - u)
        )
        for sphere, f, u in zip(spheres, unknowns, velocity, strict=True)
    ]  # fmt: skip
    force = FORCE_UNIT * np.array([f.sum(axis=0) for f in forces_at_points(unknowns)])
    residual = residuals[-1] if residuals else 0.0
    return SceneSolution(force, spheres, traction, len(residuals), float(residual))


def _near_blocks(spheres, near, level) -> dict:
    """The matrix of every ordered pair of spheres that is integrated element by element."""
    blocks = {}
    for i, j in zip(*np.nonzero(np.triu(near)), strict=True):
        shift = spheres[i].centre - spheres[j].centre
        gap = (np.linalg.norm(shift) - 1.0) / RADIUS
        # What two near spheres induce on each other differs by this part of the whole.
        tolerance = SHARE * level.accuracy * min(1.0, gap)
        pair = []
        for k in (i, j):
            mesh, turn = spheres[k].template.mesh, spheres[k].turn
            pair.append(side(SphereMesh(mesh.vertices @ turn.T, mesh.triangles), tolerance))
        blocks[i, j] = near_coupling(*pair, shift)
        blocks[j, i] = blocks[i, j].T
    return blocks
