"""Spheres that move in a linear Stokes flow: forces for given velocities, velocities for forces.

The unknowns are those of `multipoles`. A sphere meets the flow, less its own motion, as the two
lowest degrees of harmonics; force, torque and stresslet are the two lowest moments of its traction.
Where forces are given, those moments are known, and T, whose answer to a rigid motion is set to
zero, leaves them as they are; velocities are what is then left of the flow on each surface.

Every scene is solved on two levels of degrees or more, until what changes between them, the error
estimate, is within the tolerance. Lengths of the system are in the largest radius, mu = 1.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from dustfall.solution import Mobility, Resistance, Status
from dustfall.spheres import (
    checked_flow,
    checked_gradient,
    checked_radii,
    checked_scene,
    checked_tolerance,
    checked_vectors,
)
from dustfall.stokes.close_pairs import effective_coupling
from dustfall.stokes.harmonics import exact_response
from dustfall.stokes.memory import check_memory
from dustfall.stokes.moving_plan import MovingPlan, most_amplified, plan_moving
from dustfall.stokes.multipoles import (
    AXES,
    add_responses,
    couple_scene,
    incoming_flow,
    solve_system,
)
from dustfall.stokes.plan import LARGEST_TOLERANCE, PLAN_BYTES, SMALLEST_TOLERANCE
from dustfall.stokes.solve import MOST_ITERATIONS, RESIDUAL_SHARE, response_rows
from dustfall.stokes.translation import MOST_DEGREE, block_sizes, translation_tables


@dataclass(frozen=True)
class _Level:
    """Of degrees: tolerance over that of the solution, least of a close pair, most of any pair."""

    share: float
    least: int
    most: int


LEVELS = (
    _Level(1.0, 3, 30),
    _Level(0.3, 4, MOST_DEGREE),
    _Level(0.05, 5, MOST_DEGREE),
    _Level(0.005, 6, MOST_DEGREE),
)
"""The first two are always solved. Where pairs have the same degrees on both, what the finer one
leaves out by the rule of `moving_plan` is the estimate."""

SAFETY = 3.0
"""Of the error estimate over the change of levels: at 2, `benchmarks.moving_estimates` finds 2 of
35 loads above their estimate at a tolerance of 1e-2, by up to a tenth."""

FIRST_GOAL = 10.0
"""Residual of the first level, over that of the others."""

ROUNDING = 1e-14
"""Relative residual that no iteration gets below."""

CROSS = np.array([[np.cross(a, b) for b in np.eye(3)] for a in np.eye(3)]).transpose(2, 0, 1)
"""Levi-Civita's symbol: (a x b)_i = CROSS_ijk a_j b_k."""

OF_ONE, OF_COORDINATE = np.sqrt(4.0 * np.pi), np.sqrt(4.0 * np.pi / 3.0)
"""Harmonics of 1 and of a coordinate on the unit sphere."""


def resistance(
    centres,
    velocity,
    angular_velocity=None,
    flow=(0.0, 0.0, 0.0),
    gradient=None,
    radii=None,
    tolerance: float = 1e-4,
) -> Resistance:
    """Force, torque and stresslet on each of n spheres that translate and turn in a linear flow.

    centres: (n, 3) [d_p]. velocity: (n, 3) [U]. angular_velocity: (n, 3) [U / d_p], none by
    default. flow, gradient: (3,) [U] and (3, 3) [U / d_p]; far away the fluid moves as
    flow + gradient @ x. radii: (n,) [d_p], 0.5 by default. tolerance: of the error estimate, 1e-8
    to 0.1. A sphere of diameter 1 alone has the force -1 at velocity 1, the torque -1 at angular
    velocity 1, and the stresslet 5/6 of the strain.
    Raises ValueError if shapes are wrong, values are not finite, spheres overlap or touch, radii
    are not positive or more than 1,000 times each other, or the gradient has a trace, and
    MemoryError before more memory is taken than there is. Whether the tolerance is met is told by
    the status.
    """
    scene = _checked_scene(centres, radii, tolerance)
    n = len(scene.centres)
    speeds, gradients = _undisturbed(scene, flow, gradient)
    speeds = speeds - checked_vectors("velocity", velocity, n)
    turns = checked_vectors("angular_velocity", angular_velocity, n)
    gradients = gradients - np.einsum("ikj,nk->nij", CROSS, turns)
    response = _response()

    def right(coupled):
        return _answers(_harmonics(scene, coupled, speeds, gradients), coupled, response)

    def loads(coupled, moments):
        return _loads(scene, coupled, moments)

    d = scene.diameter
    scale = np.max(_size(speeds) + d * _size(gradients))
    return Resistance(*_solved(scene, True, response, right, loads, (d, d**2, d**2), scale))


def mobility(
    centres,
    force,
    torque=None,
    flow=(0.0, 0.0, 0.0),
    gradient=None,
    radii=None,
    tolerance: float = 1e-4,
) -> Mobility:
    """Velocity, angular velocity and stresslet of each of n spheres in a linear flow.

    force: (n, 3) [3 pi mu d_p U], torque: (n, 3) [pi mu d_p^2 U], none by default: what something
    else, gravity say, exerts on the spheres. All others, and errors, as in `resistance`.
    """
    scene = _checked_scene(centres, radii, tolerance)
    n, d = len(scene.centres), scene.diameter
    speeds, gradients = _undisturbed(scene, flow, gradient)
    force = checked_vectors("force", force, n)
    torque = checked_vectors("torque", torque, n)
    response = _response(free=True)
    here = _about_centres(gradients)

    def field(coupled):
        return _harmonics(scene, coupled, speeds, gradients)

    def right(coupled):
        known = _moments(scene, coupled, -force, -torque)
        return known + _answers(field(coupled), coupled, response)

    def motions(coupled, moments):
        slip = field(coupled) - incoming_flow(moments, coupled, translation_tables())
        velocity, angular_velocity = _rigid_motion(scene, coupled, slip, moments)
        return velocity - speeds, angular_velocity - here, _loads(scene, coupled, moments)[2]

    scale = max(
        np.max(_size(force) / d), np.max(_size(torque) / d**2), np.max(d * _size(gradients))
    )
    velocity, angular_velocity, *others = _solved(
        scene, False, response, right, motions, (np.ones(n), 1.0 / d, d**2), scale
    )
    return Mobility(velocity + speeds, angular_velocity + here, *others)


@dataclass(frozen=True)
class _Scene:
    """Spheres and what is asked of their solution: (n, 3), (n,), (n, n) [d_p]."""

    centres: np.ndarray
    radii: np.ndarray
    distance: np.ndarray
    tolerance: float

    @property
    def unit(self) -> float:
        """Length of the system [d_p]."""
        return float(self.radii.max())

    @property
    def diameter(self) -> np.ndarray:
        return 2.0 * self.radii


def _checked_scene(centres, radii, tolerance) -> _Scene:
    n = len(np.atleast_1d(centres))
    check_memory(n, PLAN_BYTES * n**2)
    radii = checked_radii(radii, n)
    centres, distance = checked_scene(centres, radii)
    tolerance = checked_tolerance(tolerance, SMALLEST_TOLERANCE, LARGEST_TOLERANCE)
    return _Scene(centres, radii, distance, tolerance)


def _undisturbed(scene, flow, gradient) -> tuple[np.ndarray, np.ndarray]:
    """Velocity (n, 3) and gradient (n, 3, 3) of the undisturbed flow at the centres."""
    flow, gradient = checked_flow(flow), checked_gradient(gradient)
    speeds = flow + scene.centres @ gradient.T
    return speeds, np.broadcast_to(gradient, (len(speeds), 3, 3))


def _about_centres(gradients) -> np.ndarray:
    """Angular velocity (n, 3) of a flow whose gradients are (n, 3, 3): half its vorticity."""
    return 0.5 * np.einsum("kij,nji->nk", CROSS, gradients)


def _size(values) -> np.ndarray:
    """Magnitude (n,) of vectors (n, 3) or matrices (n, 3, 3)."""
    return np.sqrt(np.sum(values.reshape(len(values), -1) ** 2, axis=1))


@cache
def _response(free: bool = False):
    """A sphere's answer up to the largest degree; `free`: none to rigid motions."""
    values = exact_response(MOST_DEGREE).copy()
    if free:
        values[0, 2] = values[1, 1] = 0.0
    return response_rows(values)


def _answers(field, coupled, response) -> np.ndarray:
    """Moments (total, 3) of the spheres of a scene that answer a field each for itself."""
    out = np.zeros_like(field)
    add_responses(field, coupled, response, out)
    return out


# From and to the lowest harmonics: velocities in U, moments over the radius in mu U.


def _harmonics(scene, coupled, speeds, gradients) -> np.ndarray:
    """Harmonics (total, 3) of flows on the spheres, with velocities and gradients at the centres"""
    starts = coupled[4]
    out = np.zeros((starts[-1], 3))
    out[starts[:-1]] = OF_ONE * speeds
    for k, axis in enumerate(AXES):
        out[starts[:-1] + 1 + k] = OF_COORDINATE * scene.radii[:, None] * gradients[:, :, axis]
    return out


def _moments(scene, coupled, force, torque) -> np.ndarray:
    """Moments (total, 3) of the tractions least in degree that have a force and a torque."""
    starts, radii = coupled[4], scene.radii[:, None]
    out = np.zeros((starts[-1], 3))
    out[starts[:-1]] = 3.0 * np.pi / OF_ONE * force / radii
    turning = 0.5 * np.pi / OF_COORDINATE * np.einsum("kji,nk->nij", CROSS, torque)
    for k, axis in enumerate(AXES):
        out[starts[:-1] + 1 + k] = turning[:, :, axis] / radii**2
    return out


def _loads(scene, coupled, moments) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Force (n, 3), torque (n, 3) and stresslet (n, 3, 3) of tractions, in a user's units."""
    starts, radii = coupled[4], scene.radii[:, None]
    force = OF_ONE / (3.0 * np.pi) * radii * moments[starts[:-1]]
    first = np.empty((len(force), 3, 3))
    for k, axis in enumerate(AXES):
        first[:, :, axis] = OF_COORDINATE / np.pi * radii**2 * moments[starts[:-1] + 1 + k]
    torque = np.einsum("kji,nij->nk", CROSS, first)
    stresslet = 0.5 * (first + first.transpose(0, 2, 1))
    stresslet -= np.trace(stresslet, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    return force, torque, stresslet


def _rigid_motion(scene, coupled, slip, moments) -> tuple[np.ndarray, np.ndarray]:
    """Velocities (n, 3) and angular velocities (n, 3) that surfaces are left with.

    slip: (total, 3), the flow on each sphere but for that of its own traction.
    """
    starts, answer = coupled[4], exact_response(1)
    velocity = slip[starts[:-1]] - moments[starts[:-1]] / answer[0, 2]
    gradients = np.empty((len(velocity), 3, 3))
    for k, axis in enumerate(AXES):
        row = starts[:-1] + 1 + k
        gradients[:, :, axis] = slip[row] - moments[row] / answer[1, 1]
    gradients /= OF_COORDINATE * scene.radii[:, None, None]
    return velocity / OF_ONE, _about_centres(gradients)


def _solved(scene, amplified, response, right, measured, units, scale) -> tuple:
    """Solve on levels of degrees until the estimate is within the tolerance.

    amplified: as in `plan_moving`. right, measured: functions of the coupled scene, and of its
    moments too, the right-hand side and what is asked for: two (n, 3) and one (n, 3, 3). units:
    (n,) of each of the three, that makes them velocities. scale: the velocity that errors are over.
    Returns the three, error estimate and what it is over, iterations, residual, smallest gap and
    status.
    """
    radii, n = scene.radii, len(scene.radii)
    gap = float(np.min(scene.distance - radii[:, None] - radii))
    if scale == 0.0:
        still = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3, 3))
        return *still, np.zeros(n), np.zeros(n), 0, 0.0, gap, Status.CONVERGED
    condition = most_amplified(scene.distance, radii) if amplified else 1.0
    goal = max(RESIDUAL_SHARE * scene.tolerance / condition, ROUNDING)
    before = coarser = None
    iterations = 0
    for level in LEVELS:
        plan = _planned(scene, amplified, level)
        check_memory(n, _memory(plan))
        coupled = _coupled(scene, plan)
        # The first is there to be compared with.
        enough = goal if coarser is not None else FIRST_GOAL * goal
        moments, taken, residual = _iterated(right(coupled), before, coupled, response, enough)
        iterations += taken
        before = moments, coupled[4]
        finer = measured(coupled, moments)
        sizes = [_size(value) / unit for value, unit in zip(finer, units, strict=True)]
        own = np.maximum(np.max(sizes, axis=0), scale)
        if coarser is not None:
            change = [
                _size(fine - coarse) / unit
                for fine, coarse, unit in zip(finer, coarser, units, strict=True)
            ]
            unsolved = np.sqrt(n) * residual * condition
            estimate = SAFETY * np.max(change, axis=0) + (plan.left_out + unsolved) * scale
            estimate += plan.unresolved * own
            estimate /= own
            if residual > goal or estimate.max() <= scene.tolerance:
                break
            # What is left out then, no finer level brings back.
            if plan.degrees.max() == MOST_DEGREE or plan.unresolved.max() > scene.tolerance:
                break
        coarser = finer
    if residual > goal or not np.isfinite(moments).all():
        status = Status.NOT_CONVERGED
    else:
        status = Status.CONVERGED if estimate.max() <= scene.tolerance else Status.OUT_OF_REACH
    return *finer, estimate, own, iterations, float(residual), gap, status


def _planned(scene, amplified, level) -> MovingPlan:
    share = level.share * scene.tolerance
    return plan_moving(scene.distance, scene.radii, share, amplified, level.least, level.most)


def _coupled(scene, plan: MovingPlan):
    """The scene as the iterations take it."""
    centres, radii = scene.centres / scene.unit, scene.radii / scene.unit
    effective = [
        effective_coupling(
            plan.degrees[i, j],
            (plan.eliminated[i, j], plan.eliminated[j, i]),
            (radii[i], radii[j]),
            scene.distance[i, j] / scene.unit,
        )
        for i, j in np.argwhere(np.tril(plan.close))
    ]
    close_pairs = plan.close, np.concatenate([np.zeros(0), *effective])
    return couple_scene(centres, radii, plan.degrees, 1, close_pairs, translation_tables())


def _iterated(right, before, coupled, response, goal):
    """Moments, iterations and residual; before: moments of fewer degrees, and their starts."""
    if len(coupled[0]) == 1:
        return right, 0, 0.0
    guess = np.zeros_like(right)
    if before is not None:
        old, old_starts = before
        for i, start in enumerate(coupled[4][:-1]):
            count = min(np.diff(old_starts)[i], np.diff(coupled[4])[i])
            guess[start : start + count] = old[old_starts[i] : old_starts[i] + count]
    return solve_system(
        right, guess, coupled, response, translation_tables(), goal, MOST_ITERATIONS
    )


def needed_memory(centres, radii=None, tolerance: float = 1e-4, moves: bool = False) -> int:
    """Bytes that `mobility`, or `resistance` where the spheres' `moves` are given, takes, about.

    PLAN_BYTES n^2 of them are taken to find it. Raises ValueError as they do, and MemoryError where
    even these are not there.
    """
    scene = _checked_scene(centres, radii, tolerance)
    return _memory(_planned(scene, moves, LEVELS[1]))


def _memory(plan: MovingPlan) -> int:
    """Bytes, at most, that the solution of a planned scene takes."""
    degrees = plan.degrees[np.tril_indices(len(plan.degrees), -1)]
    close = plan.close[np.tril_indices(len(plan.degrees), -1)]
    entries = np.array([block_sizes(degree)[1] for degree in range(MOST_DEGREE + 1)])
    # Couplings of close pairs are made one after the other, and copied.
    couplings = entries[degrees] * np.where(close, 8, 1) + 4 * (degrees + 2)
    couplings = np.sum(np.where((degrees == 1) & ~close, 0, couplings))
    moments = 3 * np.sum((np.maximum(plan.degrees.max(axis=1), 1) + 1) ** 2)
    krylov = moments * (MOST_ITERATIONS + 20)
    return 8 * int(couplings + krylov) + PLAN_BYTES * plan.degrees.size
