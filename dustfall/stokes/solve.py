"""Fixed, equal spheres in a uniform Stokes flow, by multipoles: a planned scene, solved."""

from functools import cache

import numpy as np
from numba import njit

from dustfall.solution import Solution, Status
from dustfall.spheres import flow_direction
from dustfall.stokes.harmonics import exact_response, response_matrix
from dustfall.stokes.multipoles import solve_scene
from dustfall.stokes.plan import Plan, error_bound
from dustfall.stokes.translation import MOST_DEGREE, translation_tables
from dustfall.units import CONTACT, FORCE_UNIT, RADIUS, STOKES_DRAG

MOST_ITERATIONS = 300

RESIDUAL_SHARE = 0.01
"""Of the tolerance, for the error that is left by the iteration."""


def solve(plan: Plan, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> Solution:
    """Solve a planned scene; flow and tolerance as in `methods.fixed_spheres`."""
    flow, n = flow_direction(flow), len(plan.centres)
    if not flow.any():
        gap = float(plan.distance.min() - CONTACT)
        return Solution(np.zeros((n, 3)), np.zeros(n), 0, 0.0, gap, Status.CONVERGED)
    force, estimate, iterations, residual, gap, solved = _solved(
        plan.centres, plan.distance, plan.degrees, flow, tolerance, _response(),
        translation_tables(), MOST_ITERATIONS,
    )  # fmt: skip
    if not solved:
        status = Status.NOT_CONVERGED
    else:
        status = Status.CONVERGED if estimate.max() <= tolerance else Status.OUT_OF_REACH
    return Solution(force, estimate, iterations, residual, gap, status)


# One compiled call: handing each step to NumPy takes as long as to solve most scenes.
@njit(cache=True)
def _solved(centres, distance, degrees, flow, tolerance, response, tables, most):
    """Force (n, 3), error estimate (n,), iterations, residual, smallest gap, whether solved."""
    gap = np.min(distance) - CONTACT
    # The system's condition grows as the smallest gap closes, and a residual says less; but not
    # beyond what the degrees that pairs exchange can resolve of a gap, about 1 / (2 degree^2).
    resolved = 0.5 / (np.max(degrees) + 1.0) ** 2
    condition = 1.0 / np.sqrt(min(max(gap, resolved), 1.0))
    goal = RESIDUAL_SHARE * tolerance / condition
    force, iterations, residual = solve_scene(
        centres / RADIUS, flow, degrees, response, tables, goal, most
    )
    force *= FORCE_UNIT * RADIUS
    estimate = error_bound(centres, distance, degrees, force / STOKES_DRAG)
    # The residual is relative to all spheres together, and may sit on one of them.
    estimate += np.sqrt(len(centres)) * residual * condition
    solved = residual <= goal and np.isfinite(force).all()
    return force, estimate, iterations, residual, gap, solved


@cache
def _response():
    """The exactly known answer of a sphere, up to the largest degree that pairs exchange."""
    return response_rows(exact_response(MOST_DEGREE))


def response_rows(response) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`response_matrix` as the kernels take it: data, indices and starts of its sparse rows."""
    matrix = response_matrix(response)
    return matrix.data, matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64)
