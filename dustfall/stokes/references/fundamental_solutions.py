"""The independent reference: n fixed spheres by the method of fundamental solutions.

Point forces inside every sphere stir the fluid outside; their strengths are such that the fluid
rests at more points on the surfaces than there are forces, in the sense of least squares. Nothing
is integrated, nothing is expanded, and no code is shared with the boundary elements or with the
surface harmonics: agreement with them is evidence. The error falls exponentially with the square
root of the number of point forces, faster the wider the gaps.

Lengths inside this module are in radii, velocities in units of the flow, viscosity is 1.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from scipy.sparse.linalg import LinearOperator, gmres
from scipy.spatial.distance import cdist

from dustfall.spheres import checked_centres, checked_tolerance, flow_direction
from dustfall.units import STOKES_DRAG

LADDER = [round(200 * 1.5**k) for k in range(9)]
"""Numbers of point forces a sphere that are tried in turn: 200 to 5126."""

MOST_INTERACTIONS = 2.5e8
"""Pairs of a force and a surface point that are summed, 2 to 3 ns each, once an iteration."""

POINTS_PER_FORCE = 1.5

DEPTH = 1e-9
"""Radius of the point forces, to the power sqrt(their number).

Deeper ones resolve more, until their strengths, which alternate and grow, round the result off.
"""

ARMS = 0.7
"""Arms of a lattice over sqrt(number of points): about as wide as a level is far from the next."""

CUTOFF = 1e-12
"""Singular values of one sphere's operator below this part of the largest are left out."""

MOST_ITERATIONS = 400

CAUTION = 5.0
"""Error estimate over the change since the rung before.

On 128 random pairs, gaps of 0.01 to 1 d_p, 6 % had more error than change, 2.6 times at most.
"""

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def reference_forces(centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-8):
    """Force on each of n fixed spheres in a uniform Stokes flow, and an estimate of its error.

    centres: (n, 3) [d_p]. flow: (3,), velocity far away; forces are made dimensionless by its
    magnitude. tolerance: of the force, relative to that on an isolated sphere, at least 1e-12.
    Returns the forces (n, 3) in Re_p c_D and the estimate, relative to an isolated sphere's 24: it
    follows from the largest change since the rung before and is mostly far above the error. Where
    gaps are narrow or spheres many, the ladder may end first: then the estimate exceeds the
    tolerance. Pairs reach 1e-8 at a gap of 0.025 d_p and 1e-6 at 0.01 d_p.
    Raises ValueError if shapes are wrong, values are not finite, spheres overlap or touch, or the
    tolerance is out of range.
    """
    centres, flow = checked_centres(centres), flow_direction(flow)
    tolerance = checked_tolerance(tolerance, 1e-12, 0.1)
    if not np.any(flow):
        return np.zeros_like(centres), 0.0
    rungs = _rungs(centres, tolerance)
    goal = max(1e-3 * tolerance, 1e-13)
    finer = solve_with(rungs[0], centres, flow, goal)
    for number in rungs[1:]:
        coarser, finer = finer, solve_with(number, centres, flow, goal)
        change = np.abs(finer.forces - coarser.forces).max() / STOKES_DRAG
        error = CAUTION * change + finer.residual
        if error <= tolerance:
            break
    return finer.forces, float(error)


def _rungs(centres, tolerance) -> list[int]:
    """At least two rungs, from the one below that which the narrowest gap asks for.

    With cosh(xi) = distance / d_p two spheres converge as exp(-2 xi sqrt(number)), and at best
    as the lattice does, about exp(-sqrt(number)).
    """
    n = len(centres)
    interactions = n * (n - 1) * POINTS_PER_FORCE * np.square(LADDER)
    last = max(int(np.count_nonzero(interactions <= MOST_INTERACTIONS)), 2)
    distance = cdist(centres, centres)[np.triu_indices(n, 1)].min(initial=np.inf)
    rate = min(2.0 * np.arccosh(distance), 1.0)
    needed = int(np.searchsorted(LADDER, (np.log(1.0 / tolerance) / rate) ** 2))
    first = min(max(needed - 1, 0), last - 2)
    return LADDER[first:last]


@dataclass(frozen=True)
class Solution:
    """Point forces of all spheres: their places (n, m, 3) [radii] and strengths (n, m, 3).

    residual: relative, of the linear system.
    """

    flow: np.ndarray
    places: np.ndarray
    strengths: np.ndarray
    residual: float

    @property
    def forces(self):
        """(n, 3) in Re_p c_D: an isolated sphere feels 6 pi."""
        return STOKES_DRAG / (6.0 * np.pi) * self.strengths.sum(axis=1)

    def velocity(self, points):
        """Velocity (m, 3) of the fluid at points (m, 3) [d_p] outside the spheres."""
        stirred = np.zeros_like(points)
        places = np.ascontiguousarray(self.places.reshape(-1, 3).T)
        strengths = np.ascontiguousarray(self.strengths.reshape(-1, 3).T)
        _add_stokeslets(np.ascontiguousarray(2.0 * points.T), places, strengths, stirred)
        return self.flow - stirred


def solve_with(number: int, centres, flow, goal: float = 1e-13) -> Solution:
    """Solve for about `number` point forces in each sphere; GMRES aims at a residual of `goal`.

    centres: (n, 3) [d_p]. flow: (3,). Unknown are the coefficients of each sphere's forces in the
    singular basis of its own operator: they are of the size of the velocities, while the forces
    can be a million times larger.
    """
    flow = flow_direction(flow)
    sphere = _one_sphere(number)
    n = len(centres)
    forces = sphere.forces.reshape(-1, 3)
    places = np.ascontiguousarray(forces.T)
    points = sphere.points.reshape(-1, 3)
    shift = 2.0 * (centres[:, None] - centres[None, :])

    def others(coefficients):
        """Coefficients of what all other spheres' forces stir on each sphere."""
        strengths = sphere.strengths(coefficients.view(complex).reshape(n, *sphere.shape))
        columns = [np.ascontiguousarray(own.reshape(-1, 3).T) for own in strengths]
        velocity = np.zeros((n, *sphere.points.shape))
        for i in range(n):
            for j in range(n):
                if i != j:
                    seen_from = np.ascontiguousarray((points + shift[i, j]).T)
                    _add_stokeslets(seen_from, places, columns[j], velocity[i].reshape(-1, 3))
        return sphere.coefficients(velocity).ravel().view(float)

    uniform = np.broadcast_to(flow, (n, *sphere.points.shape))
    right = sphere.coefficients(uniform).ravel().view(float)
    operator = LinearOperator((len(right), len(right)), matvec=lambda x: x + others(x), dtype=float)
    solution, _ = gmres(operator, right, rtol=goal, restart=MOST_ITERATIONS, maxiter=1)
    residual = float(np.linalg.norm(operator @ solution - right) / np.linalg.norm(right))
    strengths = sphere.strengths(solution.view(complex).reshape(n, *sphere.shape))
    return Solution(flow, forces + 2.0 * centres[:, None], strengths.reshape(n, -1, 3), residual)


@dataclass(frozen=True)
class _OneSphere:
    """The least-squares operator of a sphere, its singular values and both of its bases.

    forces (arms, levels, 3), points (arms, more levels, 3) [radii]. A turn by one arm maps
    both onto themselves, so in the axes of each arm the operator is a circular convolution, and
    its Fourier transform along the arms falls into blocks: small ones, to be decomposed one by one.
    """

    forces: np.ndarray
    points: np.ndarray
    axes: np.ndarray
    left: np.ndarray
    values: np.ndarray
    right: np.ndarray

    @property
    def shape(self):
        return self.values.shape

    def coefficients(self, velocity):
        """(n, blocks, values) that a velocity (n, arms, more levels, 3) at the points has."""
        local = (velocity @ self.axes).reshape(len(velocity), len(self.axes), -1)
        waves = np.fft.rfft(local, axis=1).transpose(1, 0, 2)
        return np.ascontiguousarray((waves @ self.left.conj()).transpose(1, 0, 2))

    def strengths(self, coefficients):
        """(n, arms, levels, 3) of the forces that stir the velocity of these coefficients."""
        waves = (coefficients / self.values).transpose(1, 0, 2) @ self.right.conj()
        local = np.fft.irfft(waves.transpose(1, 0, 2), len(self.axes), axis=1)
        local = local.reshape(len(coefficients), *self.forces.shape)
        return local @ self.axes.transpose(0, 2, 1)


@lru_cache(maxsize=3)
def _one_sphere(number: int) -> _OneSphere:
    arms = round(ARMS * np.sqrt(number))
    forces = DEPTH ** (1.0 / np.sqrt(number)) * _lattice(number, arms, 0.0)
    points = _lattice(POINTS_PER_FORCE * number, arms, 0.25)
    turn = 2.0 * np.pi * np.arange(arms) / arms
    axes = np.zeros((arms, 3, 3))  # columns: outwards along the arm, across it, up
    axes[:, 0, 0] = axes[:, 1, 1] = np.cos(turn)
    axes[:, 1, 0] = np.sin(turn)
    axes[:, 0, 1] = -axes[:, 1, 0]
    axes[:, 2, 2] = 1.0
    rows = [
        _stokeslets(own, forces[0], own_axes) for own, own_axes in zip(points, axes, strict=True)
    ]
    left, values, right = np.linalg.svd(np.fft.rfft(rows, axis=0), full_matrices=False)
    values = np.where(values > CUTOFF * values.max(), values, np.inf)
    return _OneSphere(forces, points, axes, left, values, right)


def _lattice(number: float, arms: int, shift: float):
    """Points (arms, levels, 3) of the unit sphere, evenly spread, that turn onto themselves.

    As in a sunflower head, each level is turned by a golden part of an arm against the last. There
    are as many levels as give `number` points of equal area, and more near the poles, where
    levels of equal area would be farther apart than the points.
    """
    polar = np.linspace(0.0, np.pi, 2001)
    density = np.maximum(0.5 * number / arms * np.sin(polar), np.sqrt(number / (4.0 * np.pi)))
    below = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    levels = int(np.ceil(below[-1] * polar[1]))
    count = np.arange(levels)
    polar = np.interp((count + 0.5) / levels * below[-1], below, polar)
    turn = 2.0 * np.pi / arms * (np.arange(arms)[:, None] + GOLDEN * count + shift)
    radius = np.sin(polar)
    height = np.broadcast_to(np.cos(polar), turn.shape)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=2)


def _stokeslets(points, forces, axes):
    """Matrix (3 points, 3 forces): velocity, in the given axes, that unit forces stir."""
    away = points[:, None, :] - forces[None, :, :]
    distance = np.linalg.norm(away, axis=2)[..., None, None]
    tensor = np.eye(3) / distance + away[..., :, None] * away[..., None, :] / distance**3
    return np.einsum("ba,mbkc->makc", axes, tensor.transpose(0, 2, 1, 3)).reshape(
        3 * len(points), 3 * len(forces)
    ) / (8.0 * np.pi)


@njit(cache=True, fastmath=True, error_model="numpy")
def _add_stokeslets(points, places, strengths, velocity):
    """Add to velocity (m, 3) at points (3, m) what forces (3, k) at places (3, k) stir."""
    for i in range(points.shape[1]):
        u = v = w = 0.0
        for j in range(places.shape[1]):
            x = points[0, i] - places[0, j]
            y = points[1, i] - places[1, j]
            z = points[2, i] - places[2, j]
            inverse_square = 1.0 / (x * x + y * y + z * z)
            inverse = np.sqrt(inverse_square)
            radial = strengths[0, j] * x + strengths[1, j] * y + strengths[2, j] * z
            radial *= inverse_square
            u += inverse * (strengths[0, j] + radial * x)
            v += inverse * (strengths[1, j] + radial * y)
            w += inverse * (strengths[2, j] + radial * z)
        velocity[i, 0] += u / (8.0 * np.pi)
        velocity[i, 1] += v / (8.0 * np.pi)
        velocity[i, 2] += w / (8.0 * np.pi)
