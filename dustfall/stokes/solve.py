"""Fixed, equal spheres in a uniform Stokes flow, by multipoles: a planned scene, solved."""

from functools import cache

import numpy as np

from dustfall.solution import Solution, Status
from dustfall.spheres import centre_distances, flow_direction
from dustfall.stokes.harmonics import exact_response, response_matrix
from dustfall.stokes.multipoles import solve_scene
from dustfall.stokes.plan import Plan, error_bound
from dustfall.stokes.translation import MOST_DEGREE, translation_tables
from dustfall.units import FORCE_UNIT, RADIUS, STOKES_DRAG

MOST_ITERATIONS = 300

RESIDUAL_SHARE = 0.01
"""Of the tolerance, for the error that is left by the iteration."""


def solve(plan: Plan, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> Solution:
    """Solve a planned scene; flow and tolerance as in `methods.fixed_spheres`."""
    flow = flow_direction(flow)
    distance = centre_distances(plan.centres)
    gap = float(distance.min() - 1.0)
    n = len(plan.centres)
    if not np.any(flow):
        return Solution(np.zeros((n, 3)), np.zeros(n), 0, 0.0, gap, Status.CONVERGED)
    # The system's condition grows as the smallest gap closes, and a residual says less; but not
    # beyond what the degrees that pairs exchange can resolve of a gap, about 1 / (2 degree^2).
    resolved = 0.5 / (plan.degrees.max(initial=0) + 1.0) ** 2
    condition = 1.0 / np.sqrt(min(max(gap, resolved), 1.0))
    goal = RESIDUAL_SHARE * tolerance / condition
    force, iterations, residual = solve_scene(
        plan.centres / RADIUS, flow, plan.degrees, _response(), translation_tables(), goal,
        MOST_ITERATIONS,
    )  # fmt: skip
    # The residual is relative to all spheres together, and may sit on one of them.
    force = FORCE_UNIT * RADIUS * force
    estimate = error_bound(plan.centres, distance, plan.degrees, force / STOKES_DRAG)
    estimate += np.sqrt(n) * residual * condition
    if residual > goal or not np.isfinite(force).all():
        status = Status.NOT_CONVERGED
    else:
        status = Status.CONVERGED if estimate.max() <= tolerance else Status.OUT_OF_REACH
    return Solution(force, estimate, iterations, float(residual), gap, status)


@cache
def _response():
    """The exactly known answer of a sphere, up to the largest degree that pairs exchange."""
    return response_rows(exact_response(MOST_DEGREE))


def response_rows(response) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`response_matrix` as the kernels take it: data, indices and starts of its sparse rows."""
    matrix = response_matrix(response)
    return matrix.data, matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64)
