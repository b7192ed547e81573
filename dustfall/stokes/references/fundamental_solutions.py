"""The independent reference: n spheres by the method of fundamental solutions.

Point forces inside every sphere stir the fluid outside; their strengths are such that the fluid
moves as the spheres do at more points on the surfaces than there are forces, in the sense of least
squares. Nothing is integrated, nothing is expanded, and no code is shared with the boundary
elements or with the surface harmonics: agreement with them is evidence. The error falls
exponentially with the square root of the number of point forces, faster the wider the gaps: each
sphere has as many as its own narrowest gap asks for.

Lengths inside this module are in d_p, velocities in units of the flow, viscosity is 1.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from scipy.sparse.linalg import LinearOperator, gmres

from dustfall.spheres import (
    centre_distances,
    checked_centres,
    checked_flow,
    checked_gradient,
    checked_positions,
    checked_radii,
    checked_tolerance,
    checked_vectors,
    flow_direction,
)
from dustfall.units import FORCE_UNIT, RADIUS, STOKES_DRAG

LADDER = [round(200 * 1.5**k) for k in range(11)]
"""Numbers of point forces a sphere that are tried in turn: 200 to 11,533."""

MOST_INTERACTIONS = 2.5e8
"""Pairs of a force and a surface point that are summed, 2 to 3 ns each, once an iteration."""

POINTS_PER_FORCE = 1.5

DEPTH = 1e-9
"""Radius of the point forces over that of the sphere, to the power sqrt(their number).

Deeper ones resolve more, until their strengths, which alternate and grow, round the result off.
"""

ARMS = 0.7
"""Arms of a lattice over sqrt(number of points): about as wide as a level is far from the next."""

CUTOFF = 1e-12
"""Singular values of one sphere's operator below this part of the largest are left out."""

FRESH_ARMS = 7
"""Arms of the lattice of points at which the slip is measured: no lattice of the fit has as few."""

MOST_ITERATIONS = 400

CAUTION = 5.0
"""Error estimate over the change since the rung before.

On 128 random pairs, gaps of 0.01 to 1 d_p, 6 % had more error than change, 2.6 times at most.
"""

SLIP_SQUARED = 4.0
"""Error of a load over slip^2 / gap [d of the smaller sphere] and ratio of the radii.

A load is off by the square of the slip, as the traction and the velocity err alike, and the more
the narrower the gap. On random motions of 18 pairs, radius ratios 1, 2 and 5, gaps of 0.01 to
0.1 d_p, the factor was 2 at most where the change since the rung before was less than the error.
Without it, a large sphere that has too few forces on two rungs for the image of a small one goes
unnoticed.
"""

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class Loads:
    """What the fluid exerts on n spheres, about their centres, and how well it is known.

    force: (n, 3) [3 pi mu d_p U]. torque: (n, 3), stresslet: (n, 3, 3) [pi mu d_p^2 U].
    error_estimate: (n,), of |force| / d, |torque| / d^2 and |stresslet| / d^2, d the sphere's
    diameter, over the larger of what these are and of the fastest motion of any sphere against the
    undisturbed flow, |velocity| + d |angular velocity| + d |strain|. slip: the largest velocity of
    the fluid against the spheres, between the points where it was fitted, over that fastest motion.
    """

    force: np.ndarray
    torque: np.ndarray
    stresslet: np.ndarray
    error_estimate: np.ndarray
    slip: float


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

    def error(coarser, finer):
        change = np.abs(finer.forces - coarser.forces).max() / STOKES_DRAG
        return CAUTION * change + finer.residual

    found, estimate = _climbed(Spheres.fixed(centres, flow), tolerance, error)
    return found.forces, float(estimate)


def reference_loads(
    centres,
    velocity,
    angular_velocity=None,
    flow=(0.0, 0.0, 0.0),
    gradient=None,
    radii=None,
    tolerance: float = 1e-6,
) -> Loads:
    """Loads on n spheres of any radii that translate and turn in a linear Stokes flow.

    centres, velocity, angular_velocity: (n, 3); flow + gradient @ x, (3,) and (3, 3), is the
    velocity far away; radii: (n,), 0.5 by default. Lengths in d_p, velocities in U. tolerance: of
    the error estimate, 1e-12 to 0.1; where gaps are narrow or spheres many, the ladder may end
    before it is met. Equal spheres that approach each other reach 1e-8 at a gap of 0.05 d_p.
    Raises ValueError if shapes are wrong, values are not finite, the gradient has a trace, radii
    are not positive, spheres overlap or touch, or the tolerance is out of range.
    """
    centres = checked_positions(centres)
    n = len(centres)
    radii = checked_radii(radii, n)
    spheres = Spheres(
        checked_centres(centres, radii),
        radii,
        checked_vectors("velocity", velocity, n),
        checked_vectors("angular_velocity", angular_velocity, n),
        checked_flow(flow),
        checked_gradient(gradient),
    )
    tolerance = checked_tolerance(tolerance, 1e-12, 0.1)
    size = spheres.fastest()
    if size == 0.0:
        still = np.zeros((n, 3))
        return Loads(still, still, np.zeros((n, 3, 3)), np.zeros(n), 0.0)

    def error(coarser, finer):
        changes, loads = _parts(spheres, finer, coarser), _parts(spheres, finer)
        relative = CAUTION * changes.max(axis=0) / np.maximum(loads.max(axis=0), size)
        return np.maximum(relative, _error_by_slip(spheres, finer.slip() / size)) + finer.residual

    found, estimate = _climbed(spheres, tolerance, error)
    force, torque, stresslet = found.loads()
    return Loads(force, torque, stresslet, estimate, float(found.slip().max() / size))


def _error_by_slip(spheres, slip) -> np.ndarray:
    """Error (n,) of each sphere's loads that a slip (n,) on the spheres tells of.

    A pair's slip is that of its worse sphere; others feel a sphere's error as its Stokeslet.
    """
    radii = spheres.radii
    smaller = np.minimum(radii[:, None], radii)
    ratio = np.maximum(radii[:, None], radii) / smaller
    gap = np.minimum(_gaps(spheres.centres, radii) / (2.0 * smaller), 1.0)
    worse = np.maximum(slip[:, None], slip)
    own = np.max(SLIP_SQUARED * ratio / gap * worse**2, axis=1)
    return own + 1.5 * (radii / centre_distances(spheres.centres)) @ own


def _parts(spheres, solution, less=None):
    """|force| / d, |torque| / d^2, |stresslet| / d^2 (3, n) of a solution, or of a difference."""
    diameter, loads = 2.0 * spheres.radii, solution.loads()
    if less is not None:
        loads = [own - other for own, other in zip(loads, less.loads(), strict=True)]
    sizes = [np.sqrt(np.square(load.reshape(len(load), -1)).sum(axis=1)) for load in loads]
    return np.array([sizes[0] / diameter, sizes[1] / diameter**2, sizes[2] / diameter**2])


@dataclass(frozen=True)
class Spheres:
    """Centres, radii and the motion (n, 3), (n, 3) of n spheres in the flow + gradient @ x."""

    centres: np.ndarray
    radii: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    flow: np.ndarray
    gradient: np.ndarray

    @classmethod
    def fixed(cls, centres, flow):
        still = np.zeros_like(centres)
        radii = np.full(len(centres), RADIUS)
        return cls(centres, radii, still, still, flow, np.zeros((3, 3)))

    def slip(self, i, points):
        """Velocity (m, 3) of the undisturbed flow against sphere i at points about its centre."""
        motion = self.velocity[i] + np.cross(self.angular_velocity[i], points)
        return self.flow + (self.centres[i] + points) @ self.gradient.T - motion

    def fastest(self):
        """|velocity| + d (|angular velocity| + |strain|) against the flow, the largest of all."""
        speed = self.flow + self.centres @ self.gradient.T - self.velocity
        curl = [self.gradient[k - 1, k - 2] - self.gradient[k - 2, k - 1] for k in range(3)]
        turning = np.linalg.norm(self.angular_velocity - 0.5 * np.array(curl), axis=1)
        strain = np.linalg.norm(0.5 * (self.gradient + self.gradient.T))
        return np.max(np.linalg.norm(speed, axis=1) + 2.0 * self.radii * (turning + strain))


def _gaps(centres, radii):
    """(n, n) distances of surfaces [d_p], inf on the diagonal."""
    return centre_distances(centres) - radii[:, None] - radii


def _climbed(spheres: Spheres, tolerance, error):
    """Solution and its error against the rung before, within the tolerance where a rung is left.

    Spheres whose own error is too large go one rung up, until all interactions are too many.
    """
    goal = max(1e-3 * tolerance, 1e-13)
    rung = _first_rungs(spheres, tolerance)
    finer = _solved_on(rung - 1, spheres, goal)
    while True:
        coarser, finer = finer, _solved_on(rung, spheres, goal)
        estimate = error(coarser, finer)
        higher = np.minimum(rung + (estimate > tolerance), len(LADDER) - 1)
        if (higher == rung).all() or _interactions(higher) > MOST_INTERACTIONS:
            return finer, estimate
        rung = higher


def _first_rungs(spheres, tolerance) -> np.ndarray:
    """Rungs (n,) of LADDER, the first or higher ones, that should be needed, or as high as can be.

    A sphere's images in another converge at exp(-xi) of its radius, xi their bispherical
    coordinate, and so its forces as exp(-2 xi sqrt(number)), and at best as the lattice does, about
    exp(-sqrt(number)).
    """
    a, b = spheres.radii[:, None], spheres.radii
    distance = centre_distances(spheres.centres)
    gap = _gaps(spheres.centres, spheres.radii)
    with np.errstate(invalid="ignore"):
        both = np.arccosh(1.0 + gap * (gap + 2.0 * (a + b)) / (2.0 * a * b))
        xi = np.arcsinh(b * np.sinh(both) / distance)
    rate = np.minimum(2.0 * np.fmin.reduce(xi, axis=1, initial=np.inf), 1.0)
    needed = np.searchsorted(LADDER, (np.log(1.0 / tolerance) / rate) ** 2)
    while True:
        rung = np.clip(needed, 1, len(LADDER) - 1)
        if _interactions(rung) <= MOST_INTERACTIONS or rung.max() == 1:
            return rung
        needed -= 1


def _interactions(rung) -> float:
    """Pairs of a force and a surface point of two spheres on these rungs (n,)."""
    numbers = np.array(LADDER)[rung]
    return POINTS_PER_FORCE * float(numbers.sum() ** 2 - (numbers**2).sum())


def _solved_on(rung, spheres, goal):
    return solve_with(np.array(LADDER)[rung], spheres, goal)


@dataclass(frozen=True)
class Solution:
    """Point forces of n spheres: of each, their places (m, 3) [d_p] and strengths (m, 3).

    residual: relative, of the linear system.
    """

    spheres: Spheres
    places: list[np.ndarray]
    strengths: list[np.ndarray]
    residual: float

    @property
    def forces(self):
        """(n, 3) in Re_p c_D: a sphere alone feels 3 pi at unit velocity."""
        return FORCE_UNIT * np.array([own.sum(axis=0) for own in self.strengths])

    def loads(self):
        """Force (n, 3), torque (n, 3) and stresslet (n, 3, 3), in the units of `Loads`."""
        force, torque, stresslet = [], [], []
        about = zip(self.spheres.centres, self.places, self.strengths, strict=True)
        for centre, places, strengths in about:
            moment = (places - centre).T @ strengths
            force.append(strengths.sum(axis=0) / (3.0 * np.pi))
            torque.append(np.cross(places - centre, strengths).sum(axis=0) / np.pi)
            stresslet.append((moment + moment.T) / 2.0 - np.trace(moment) / 3.0 * np.eye(3))
        return np.array(force), np.array(torque), np.array(stresslet) / np.pi

    def velocity(self, points):
        """Velocity (m, 3) of the fluid at points (m, 3) [d_p] outside the spheres."""
        stirred = np.zeros_like(points)
        places, strengths = np.concatenate(self.places), np.concatenate(self.strengths)
        _add_stokeslets(_columns(points), _columns(places), _columns(strengths), stirred)
        return self.spheres.flow + points @ self.spheres.gradient.T - stirred

    def slip(self):
        """Largest velocity (n,) of the fluid against each sphere, between the points of the fit."""
        spheres, found = self.spheres, np.empty(len(self.places))
        for i, (places, radius) in enumerate(zip(self.places, spheres.radii, strict=True)):
            surface = radius * _lattice(POINTS_PER_FORCE * len(places), FRESH_ARMS, 0.6).reshape(
                -1, 3
            )
            own = spheres.velocity[i] + np.cross(spheres.angular_velocity[i], surface)
            slip = self.velocity(spheres.centres[i] + surface) - own
            found[i] = np.linalg.norm(slip, axis=1).max()
        return found


def solve_with(numbers, spheres: Spheres, goal: float = 1e-13) -> Solution:
    """Solve for about `numbers` point forces in each sphere; GMRES aims at a residual of `goal`.

    numbers: for all spheres, or (n,). Unknown are the coefficients of each sphere's forces in the
    singular basis of its own operator: they are of the size of the velocities, while the forces
    can be a million times larger.
    """
    n = len(spheres.centres)
    templates = [_one_sphere(int(number)) for number in np.broadcast_to(numbers, n)]
    ends = np.cumsum([2 * template.values.size for template in templates])[:-1]
    bodies = list(zip(templates, spheres.centres, spheres.radii, strict=True))
    places = [centre + radius * own.forces.reshape(-1, 3) for own, centre, radius in bodies]
    points = [centre + radius * own.points.reshape(-1, 3) for own, centre, radius in bodies]
    sources, targets = [_columns(own) for own in places], [_columns(own) for own in points]

    def strengths(coefficients):
        """Of all point forces: those of a sphere stir as much as if it were larger and so they."""
        parts = np.split(coefficients, ends)
        return [
            radius * own.strengths(part.view(complex).reshape(own.shape)).reshape(-1, 3)
            for part, (own, _, radius) in zip(parts, bodies, strict=True)
        ]

    def coefficients(velocities):
        return np.concatenate(
            [
                own.coefficients(velocity.reshape(own.points.shape)).ravel().view(float)
                for own, velocity in zip(templates, velocities, strict=True)
            ]
        )

    def with_others(unknown):
        """Coefficients and those of what all other spheres' forces stir on each sphere."""
        forces = [_columns(own) for own in strengths(unknown)]
        velocities = [np.zeros_like(own) for own in points]
        for i, velocity in enumerate(velocities):
            for j in range(n):
                if i != j:
                    _add_stokeslets(targets[i], sources[j], forces[j], velocity)
        return unknown + coefficients(velocities)

    right = coefficients(
        [spheres.slip(i, own - spheres.centres[i]) for i, own in enumerate(points)]
    )
    operator = LinearOperator((len(right), len(right)), matvec=with_others, dtype=float)
    solution, _ = gmres(operator, right, rtol=goal, restart=MOST_ITERATIONS, maxiter=1)
    residual = float(np.linalg.norm(operator @ solution - right) / np.linalg.norm(right))
    return Solution(spheres, places, strengths(solution), residual)


def _columns(vectors):
    """(3, m) of vectors (m, 3), contiguous."""
    return np.ascontiguousarray(vectors.T)


@dataclass(frozen=True)
class _OneSphere:
    """The least-squares operator of a sphere, its singular values and both of its bases.

    forces (arms, levels, 3), points (arms, more levels, 3) of the unit sphere. A turn by one arm
    maps both onto themselves, so in the axes of each arm the operator is a circular convolution,
    and its Fourier transform along the arms falls into blocks: small ones, decomposed one by one.
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
        """(blocks, values) that a velocity (arms, more levels, 3) at the points has."""
        local = (velocity @ self.axes).reshape(len(self.axes), -1)
        waves = np.fft.rfft(local, axis=0)[:, None]
        return np.ascontiguousarray((waves @ self.left.conj())[:, 0])

    def strengths(self, coefficients):
        """(arms, levels, 3) of the forces that stir the velocity of these coefficients."""
        waves = (coefficients / self.values)[:, None] @ self.right.conj()
        local = np.fft.irfft(waves[:, 0], len(self.axes), axis=0)
        return local.reshape(self.forces.shape) @ self.axes.transpose(0, 2, 1)


@lru_cache(maxsize=len(LADDER))
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
