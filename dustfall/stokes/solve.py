"""Fixed spheres in a uniform Stokes flow: what a user calls, and the multipole solve behind it."""

import warnings
from functools import cache

import numpy as np

from dustfall.solution import Solution, Status
from dustfall.spheres import centre_distances, flow_direction
from dustfall.stokes.harmonics import exact_response, response_matrix
from dustfall.stokes.multipoles import solve_scene
from dustfall.stokes.plan import Plan, error_bound, plan_scene
from dustfall.stokes.translation import MOST_DEGREE, translation_tables
from dustfall.units import FORCE_UNIT, RADIUS, STOKES_DRAG

MOST_ITERATIONS = 300

RESIDUAL_SHARE = 0.01
"""Of the tolerance, for the error that is left by the iteration."""


def forces_on_fixed_spheres(centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> np.ndarray:
    """Force on each of n fixed, equal spheres in a uniform Stokes flow.

    centres: (n, 3) in d_p. flow: (3,), velocity far away; forces are made dimensionless by its
    magnitude. tolerance: of the force, relative to that on an isolated sphere, 1e-8 to 0.1.
    Returns (n, 3) in Re_p c_D: an isolated sphere feels 24 along the flow; no flow, no force.
    Raises ValueError if shapes are wrong, values are not finite, or spheres overlap, and
    RuntimeError if GMRES does not converge. Warns where the estimated error exceeds the tolerance.
    """
    solution = solve(plan_scene(centres, tolerance), flow, tolerance)
    if solution.status == Status.NOT_CONVERGED:
        raise RuntimeError(
            f"GMRES stopped at a residual of {solution.residual:.1e} after "
            f"{solution.iterations} iterations; smallest gap {solution.minimum_gap:.1e} d_p"
        )
    if solution.status == Status.OUT_OF_REACH:
        warnings.warn(
            f"the estimated error, {solution.error_estimate.max():.1e}, exceeds the tolerance, "
            f"{tolerance:.1e}: the smallest gap is {solution.minimum_gap:.1e} d_p",
            RuntimeWarning,
            stacklevel=2,
        )
    return solution.force


def solve(plan: Plan, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> Solution:
    """Solve a planned scene; flow and tolerance as in `forces_on_fixed_spheres`."""
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
