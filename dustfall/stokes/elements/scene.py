"""Fixed spheres in a uniform Stokes flow by boundary elements on gmsh meshes, and their errors.

A scene is solved on two levels of meshes. Every part of a level is coarser than that of the next:
elements, grading, quadrature, the points through which far spheres meet. So the difference of
the forces says how wrong the coarser level is, and bounds the error of the finer one.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import LinearOperator, gmres

from dustfall.solution import Solution, Status
from dustfall.spheres import (
    centre_distances,
    checked_scene,
    checked_tolerance,
    flow_direction,
)
from dustfall.stokes.elements.element_pairs import coupling, side
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.stokeslet import put_block, stokeslet
from dustfall.stokes.elements.templates import (
    LEVELS,
    MOST_DEGREE,
    Exchange,
    Level,
    Template,
    gradings_for,
    template,
    template_facing,
)
from dustfall.units import CONTACT, FORCE_UNIT, RADIUS, STOKES_DRAG

MOST_ITERATIONS = 300

NARROWEST_GAP = 1e-5
"""Smallest distance of two surfaces [d_p] that the gradings of templates serve."""

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

    def __init__(self, spheres: list[MeshedSphere], near, tolerance: float):
        self.spheres = spheres
        ends = np.cumsum([0] + [len(sphere.template.matrix) for sphere in spheres])
        matrix = np.zeros((ends[-1], ends[-1]))
        for i, sphere in enumerate(spheres):
            matrix[ends[i] : ends[i + 1], ends[i] : ends[i + 1]] = sphere.template.matrix
            for j in np.flatnonzero(near[i, :i]):
                block = _near_block(sphere, spheres[j], tolerance)
                matrix[ends[i] : ends[i + 1], ends[j] : ends[j + 1]] = block
                matrix[ends[j] : ends[j + 1], ends[i] : ends[i + 1]] = block.T
        self._ends = ends[1:-1] // 3
        self._point_ends = np.cumsum([len(sphere.exchange.points) for sphere in spheres])[:-1]
        self._factor = lu_factor(matrix, overwrite_a=True, check_finite=False)

    def tractions(self, velocity) -> list[np.ndarray]:
        """Tractions of the nodes of each sphere, seen by its template."""
        own = np.split(velocity, self._point_ends)
        pairs = zip(self.spheres, own, strict=True)
        load = np.concatenate([sphere.loads(u) for sphere, u in pairs])
        traction = lu_solve(self._factor, load.ravel(), check_finite=False)
        return np.split(traction.reshape(-1, 3), self._ends)

    def forces(self, velocity) -> np.ndarray:
        """Forces at the points of all spheres by velocities there, (p, 3) each."""
        pairs = zip(self.spheres, self.tractions(velocity), strict=True)
        return np.concatenate([sphere.forces(f) for sphere, f in pairs])


def _near_block(target: MeshedSphere, source: MeshedSphere, tolerance: float) -> np.ndarray:
    """Loads of one sphere by the tractions of another, both as seen by their templates."""
    shift = target.centre - source.centre
    block = coupling(side(target.mesh(), tolerance), side(source.mesh(), tolerance), shift)
    rows, columns = block.shape
    block = target.turn.T @ block.reshape(rows // 3, 3, columns)
    return (block.reshape(-1, 3) @ source.turn).reshape(rows, columns)


def mesh_scene(centres, level: Level):
    """Choose, and where needed make, the mesh of every sphere.

    centres: (n, 3) [d_p]. Returns the spheres and which pairs are near, (n, n).
    """
    distance = centre_distances(centres)
    gap = distance - CONTACT
    degrees = _exchange_degrees(distance, _coupling_tolerance(distance, level))
    near = (degrees > MOST_DEGREE) & np.isfinite(distance)
    spheres = []
    for i in range(len(centres)):
        close = np.flatnonzero(near[i])
        directions = (centres[close] - centres[i]) / distance[i, close, None]
        own, turn = template_facing(level, directions, gradings_for(gap[i, close]))
        degree = int(np.where(near[i], 1, degrees[i]).max())
        spheres.append(MeshedSphere(own, centres[i], turn, own.exchange(degree)))
    return spheres, near


def _coupling_tolerance(distance, level: Level) -> float:
    """How well a pair has to be coupled: near spheres amplify what they do not feel alike.

    By about 1 / gap, and all pairs of the scene do it to the nearest one.
    """
    return SHARE * level.accuracy * min(1.0, (distance.min() - CONTACT) / RADIUS)


def _exchange_degrees(distance, tolerance) -> np.ndarray:
    """Degree (n, n) that each pair has to exchange.

    Harmonics of degree l fall off as exp(-xi l) from one sphere to another, cosh(xi) = distance /
    d_p (Stimson and Jeffery 1926), once where a third sphere, or the other, excites them and once
    where they are felt. A near pair multiplies what reaches it by about 1 / gap.
    """
    n = len(distance)
    xi = np.arccosh(distance)
    nearest = xi.min(axis=1)
    excited = np.minimum(nearest[:, None], nearest[None, :])
    degrees = np.zeros((n, n))
    apart = ~np.eye(n, dtype=bool)
    degrees[apart] = np.ceil(np.log(1.0 / tolerance) / (xi + excited)[apart] - 1.0)
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
class MeshSolution(Solution):
    """A `Solution` with the meshes that it was found on.

    spheres: as meshed. traction: of each sphere (nodes, 3), at the vertices of its mesh and then at
    the middles of the edges [mu U / d_p]; its normal part has no mean, because no pressure inside a
    sphere moves the fluid. Both are empty where the gap is too narrow to be meshed.
    """

    spheres: list[MeshedSphere]
    traction: list[np.ndarray]


def fixed_spheres_on_meshes(centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> MeshSolution:
    """Force on each of n fixed, equal spheres in a uniform Stokes flow, by boundary elements.

    centres, flow: as in `forces_on_fixed_spheres`. tolerance: of the force, relative to that on an
    isolated sphere, 1e-8 to 0.1; the levels are made for 1e-6 and more.
    The first level meant for the tolerance is taken with the one before; if they differ too much,
    the next as well. Where spheres are closer than NARROWEST_GAP, no force is found: it is nan, its
    error inf. Raises ValueError for what `forces_on_fixed_spheres` refuses.
    """
    tolerance = checked_tolerance(tolerance, 1e-8, 0.1)
    (centres, distance), flow = checked_scene(centres), flow_direction(flow)
    n = len(centres)
    gap = float(distance.min() - CONTACT)
    if not np.any(flow):
        spheres, _ = mesh_scene(centres, LEVELS[0])
        still = [np.zeros((len(sphere.exchange.spread), 3)) for sphere in spheres]
        return MeshSolution(
            np.zeros((n, 3)), np.zeros(n), 0, 0.0, gap, Status.CONVERGED, spheres, still
        )
    if gap < NARROWEST_GAP:
        nowhere, unknown = np.full((n, 3), np.nan), np.full(n, np.inf)
        return MeshSolution(nowhere, unknown, 0, np.inf, gap, Status.OUT_OF_REACH, [], [])
    strain = np.sqrt(min(gap, 1.0))
    first = next((k for k in range(1, len(LEVELS)) if LEVELS[k].accuracy <= tolerance), -1)
    first %= len(LEVELS)
    coarse = _solve_on(centres, flow, LEVELS[first - 1], strain)
    for level in LEVELS[first : first + 2]:
        fine = _solve_on(centres, flow, level, strain)
        # On one sphere the errors of both levels may be alike; on all of them they are not.
        difference = np.linalg.norm(fine.force - coarse.force, axis=1).max() / STOKES_DRAG
        error = difference + template(level).lone_error + SHARE * level.accuracy
        error += np.sqrt(n) * fine.residual / strain
        estimate = np.full(n, error)
        if fine.residual > _goal(level, strain):
            status = Status.NOT_CONVERGED
        else:
            reached = error <= tolerance
            status = Status.CONVERGED if reached else Status.OUT_OF_REACH
        if status != Status.OUT_OF_REACH:
            break
        coarse = fine
    return MeshSolution(
        fine.force, estimate, fine.iterations, fine.residual, gap, status,
        fine.spheres, fine.traction,
    )  # fmt: skip


def _goal(level: Level, strain) -> float:
    """Relative residual: the system's condition grows as the smallest gap closes."""
    return 0.01 * level.accuracy * strain


@dataclass(frozen=True, eq=False)
class _OnLevel:
    """Forces (n, 3) [Re_p c_D] of one level of meshes, and how they were found."""

    force: np.ndarray
    iterations: int
    residual: float
    spheres: list[MeshedSphere]
    traction: list[np.ndarray]


def _solve_on(centres, flow, level: Level, strain: float) -> _OnLevel:
    """Solve a scene on one level; centres (n, 3) [d_p], flow (3,) of length 1.

    Unknown are the forces at the points of all spheres: forces = answer(flow - coupling forces).
    """
    tolerance = _coupling_tolerance(centre_distances(centres), level)
    spheres, near = mesh_scene(centres, level)
    _, cluster = connected_components(near, directed=False)
    # Spheres of a cluster stand side by side.
    order = np.argsort(cluster, kind="stable")
    members = np.split(order, np.cumsum(np.bincount(cluster))[:-1])
    bodies = [
        Cluster([spheres[i] for i in own], near[np.ix_(own, own)], tolerance)
        if len(own) > 1
        else LoneSphere(spheres[own[0]])
        for own in members
    ]
    points = [spheres[i].points() for i in order]
    owner = np.repeat(order, [len(own) for own in points])
    exchanged = _point_coupling(np.concatenate(points), owner, near)
    ends = np.cumsum([sum(len(spheres[i].exchange.points) for i in own) for own in members])[:-1]

    def answer(velocity):
        parts = zip(bodies, np.split(velocity, ends), strict=True)
        return np.concatenate([body.forces(u) for body, u in parts]).ravel()

    def system(forces):
        return forces + answer((exchanged @ forces).reshape(-1, 3))

    undisturbed = np.tile(flow, (len(owner), 1))
    right = answer(undisturbed)
    forces = right
    residuals: list[float] = []
    # Spheres of a cluster that are not near to each other meet here too.
    if exchanged.any():
        operator = LinearOperator((len(right), len(right)), matvec=system, dtype=float)
        forces, _ = gmres(
            operator, right, rtol=_goal(level, strain), restart=MOST_ITERATIONS, maxiter=1,
            callback=residuals.append, callback_type="pr_norm",
        )  # fmt: skip
    velocity = np.split(undisturbed - (exchanged @ forces).reshape(-1, 3), ends)
    traction = [np.empty(0)] * len(spheres)
    for own, body, u in zip(members, bodies, velocity, strict=True):
        for i, f in zip(own, body.tractions(u), strict=True):
            traction[i] = f @ spheres[i].turn.T
    force = np.zeros((len(spheres), 3))
    np.add.at(force, owner, FORCE_UNIT * forces.reshape(-1, 3))
    residual = float(residuals[-1]) if residuals else 0.0
    return _OnLevel(force, len(residuals), residual, spheres, traction)
