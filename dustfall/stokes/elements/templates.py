"""Meshed spheres, assembled and inverted once: what every sphere of every scene is a copy of.

A sphere far from all others takes the plain template of a level; one that nearly touches another
takes the template that is graded towards one point of its equator, turned until the point faces the
gap. Only a sphere with several narrow gaps needs a mesh of its own.

Spheres that are not close exchange what a few points carry. With the points x_p and weights w_p of
Lebedev's rule (1976), exact to degree 2 L, any field on the sphere is taken through its values at
the points, u(x) ~ sum_p w_p sum_(l <= L) (2 l + 1) P_l(x . x_p) u(x_p) (hyperinterpolation, Sloan
1995), and the traction leaves as one force at each point by the transposed map. So a far pair costs
p^2 Stokeslets, and no field of the mesh is replaced by one of harmonics within a sphere.
"""

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legval
from scipy.integrate import lebedev_rule
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from dustfall.stokes.elements.mesh import SphereMesh, sphere_mesh
from dustfall.stokes.elements.single_layer import nodal_integrals, self_interaction
from dustfall.units import FORCE_UNIT, RADIUS, STOKES_DRAG


class Level(NamedTuple):
    """How finely a sphere is discretised.

    size: edge length [radii]. accuracy: relative error of forces that it is meant for.
    singular_points: as in `self_interaction`.
    """

    size: float
    accuracy: float
    singular_points: int


LEVELS = (
    Level(1.3, 1e-3, 5),
    Level(0.85, 3e-4, 5),
    Level(0.65, 1e-4, 5),
    Level(0.5, 1e-5, 5),
    Level(0.35, 1e-6, 6),
)
"""34, 48, 80, 154 and 254 elements where no gap is narrow."""

RESOLVED = 1.45
"""A gap g [radii] is resolved by edges of RESOLVED sqrt(g) times the level's size: the traction
varies over sqrt(g). Measured on scenes with gaps of 0.0013 to 0.08 d_p, twice as much leaves up to
2e-4 at the level 1e-4, this 2e-5, half as much no less at twice the cost."""

MOST_GRADINGS = 7
"""How often the edge length is halved at most; serves gaps down to 1.5e-5 d_p."""


@dataclass(frozen=True, eq=False)
class Exchange:
    """How a template meets far spheres.

    points: (p, 3) unit vectors. spread: (n, p), weight of the velocity at a point in the load of a
    node, and of the traction of a node in the force at a point.
    """

    points: np.ndarray
    spread: np.ndarray
    template: "Template"

    @cached_property
    def response(self) -> np.ndarray:
        """(3p, 3p), forces at the points of a sphere alone by the velocities there."""
        spread = np.kron(self.spread, np.eye(3))
        return spread.T @ (self.template.inverse @ spread)


class Template:
    """A mesh of the sphere with its single-layer matrix; lengths in d_p, mu = 1.

    Traction and test functions are continuous and quadratic on projected elements
    (`single_layer`). matrix: (3n, 3n), symmetric and positive definite, because the outer product
    of the normals, which no flow excites, is added to the single layer.
    """

    def __init__(self, mesh: SphereMesh, level: Level):
        self.mesh, self.level = mesh, level
        self.matrix = self_interaction(mesh, level.singular_points, 0.01 * level.accuracy)
        normals = nodal_integrals(mesh, lambda n: n).ravel()
        self.matrix += np.outer(normals, normals)
        self._exchanges: dict[int, Exchange] = {}

    @cached_property
    def inverse(self) -> np.ndarray:
        """(3n, 3n), tractions at the nodes by their loads."""
        factor = cho_factor(self.matrix, lower=True, check_finite=False)
        return cho_solve(factor, np.eye(len(self.matrix)), overwrite_b=True, check_finite=False)

    @cached_property
    def lone_error(self) -> float:
        """Relative error of the drag on a lone sphere, whatever the direction of the flow."""
        response = self.exchange(1).response.reshape(-1, 3, len(self.exchange(1).points), 3)
        drag = FORCE_UNIT / STOKES_DRAG * response.sum(axis=(0, 2))
        return float(np.linalg.norm(drag - np.eye(3), 2))

    def exchange(self, degree: int) -> Exchange:
        """Points and maps that carry fields up to this degree."""
        if degree not in self._exchanges:
            points, weights = exchange_rule(degree)
            factors = 2.0 * np.arange(degree + 1.0) + 1.0
            spread = nodal_integrals(
                self.mesh, lambda n: legval(n @ points.T, factors) * weights, 8 + degree // 2
            )
            self._exchanges[degree] = Exchange(points, spread, self)
        return self._exchanges[degree]


def exchange_rule(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (p, 3) and weights (p,) with sum 1, exact up to twice the degree or better."""
    points, weights = lebedev_rule(_lebedev_degree(2 * degree))
    return np.ascontiguousarray(points.T), weights / weights.sum()


def _lebedev_degree(least: int) -> int:
    """The smallest that has a rule of positive weights."""
    return next(d for d in LEBEDEV_DEGREES if d >= least)


LEBEDEV_DEGREES = (3, 5, 7, 9, 11, 15, 17, 19, 21)
"""Degrees of Lebedev's rules, 6 to 170 points, without that of 13, which has negative weights."""

MOST_DEGREE = LEBEDEV_DEGREES[-1] // 2
"""Largest degree by which two spheres exchange fields: closer pairs are integrated in full, which
is cheaper by then."""

FRONT = np.array([-1.0, 0.0, 0.0])
"""Where templates are graded: opposite the seam of gmsh's sphere and off its poles, next to which
elements are thin."""


DIGITS = 6
"""Decimals of a direction by which meshes with several fine spots are told apart: far below an
edge, far above rounding."""

KEPT = 12
"""Meshes with several fine spots that are kept, 10 to 30 MB each: a scene's on two levels."""


@cache
def template(level: Level, grading: int = 0) -> Template:
    """The template whose edges are halved `grading` times at FRONT (0: nowhere)."""
    toward = [FRONT] if grading else []
    return Template(sphere_mesh(level.size, toward, level.size / 2.0**grading), level)


def template_facing(level: Level, directions, gradings) -> tuple[Template, np.ndarray]:
    """A template and the rotation (3, 3) that turns it so that fine elements face all gaps.

    directions: (k, 3) unit vectors to the spheres that are close; gradings: (k,) halvings there.
    """
    gradings = np.asarray(gradings)
    graded = np.flatnonzero(gradings)
    if len(graded) == 0:
        return template(level), np.eye(3)
    graded = graded[np.argsort(-gradings[graded], kind="stable")]
    directions, gradings = np.asarray(directions)[graded], gradings[graded]
    first = directions[0]
    if len(graded) == 1:
        turn = Rotation.align_vectors([first], [FRONT])[0].as_matrix()
        return template(level, int(gradings[0])), turn
    # In a frame of the directions' own, spheres that are neighboured alike share a mesh.
    side = np.cross(first, directions[1])
    if np.linalg.norm(side) < 1e-6:
        side = np.cross(first, np.eye(3)[np.argmin(np.abs(first))])
    side /= np.linalg.norm(side)
    turn = np.column_stack([-first, np.cross(side, -first), side])
    toward = np.round(directions @ turn, DIGITS)
    return _template_of_its_own(level, tuple(map(tuple, toward)), tuple(map(int, gradings))), turn


@lru_cache(maxsize=KEPT)
def _template_of_its_own(level: Level, toward, gradings) -> Template:
    return Template(sphere_mesh(level.size, toward, level.size / 2.0 ** np.array(gradings)), level)


def gradings_for(gap) -> np.ndarray:
    """Halvings of the edge length that gaps [d_p] ask for."""
    edge = RESOLVED * np.sqrt(np.asarray(gap) / RADIUS)
    return np.clip(np.ceil(-np.log2(edge)), 0, MOST_GRADINGS).astype(int)
