"""Fixed spheres in a uniform Stokes flow: plan a scene, then solve it.

The plan says how many degrees of surface harmonics each pair of spheres exchanges; the solve
couples them (`compressed`), each sphere answering with its one-body operator.
"""

import warnings
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit

from dustfall.spheres import centre_distances, checked_centres, checked_flow
from dustfall.stokes.elements.mesh import sphere_mesh
from dustfall.stokes.elements.one_body import OneBody
from dustfall.stokes.harmonics import exact_response, response_matrix, single_layer_spectrum
from dustfall.stokes.multipoles import solve_scene
from dustfall.stokes.translation import MOST_DEGREE, translation_tables
from dustfall.units import FORCE_UNIT, RADIUS

TEMPLATE_SIZE = 0.5
"""Edge length [radii] of the template that `forces_on_fixed_spheres` uses: 154 elements."""

MOST_ITERATIONS = 300

CONVERGED, NOT_CONVERGED, OUT_OF_REACH = 0, 1, 2
"""Status of a record: GMRES reached its residual, or ran out of iterations; or it reached it, but
the error estimate exceeds the tolerance, because the degrees end before the gap is resolved."""


@dataclass(frozen=True)
class Plan:
    """How many degrees of harmonics each pair of a scene exchanges.

    centres: (n, 3) [d_p]. orders: (n, n), symmetric, zero on the diagonal. error: (n,) estimate of
    the error of each sphere's force, over an isolated sphere's, from the degrees left out.
    """

    centres: np.ndarray
    orders: np.ndarray
    error: np.ndarray


@dataclass(frozen=True)
class Solution:
    """Forces (n, 3) [Re_p c_D] and what is known of their quality.

    residual: relative, of the preconditioned system. error_estimate: (n,), relative to 24.
    minimum_gap: smallest surface distance of two spheres [d_p], inf for one sphere.
    """

    force: np.ndarray
    iterations: int
    residual: float
    error_estimate: np.ndarray
    minimum_gap: float
    status: int


@njit(cache=True)
def truncation_error(order, excited, felt):
    """Relative error of a force that comes of leaving out harmonics above `order`.

    A sphere j is excited by a sphere k and felt by a sphere i (which may be k); excited, felt: xi
    of both pairs, cosh(xi) = distance / d_p. Each way costs a harmonic of degree l a factor
    exp(-xi l) (for two spheres, Stimson and Jeffery 1926), so the error is geometric in the order
    where spheres are apart; where they nearly touch it falls with the cube of the order. Constants
    are fitted to pairs, triangles, chains, tetrahedra and six spheres with gaps from 0.001 to 3
    d_p, orders from 0 to 32, and to random scenes.
    """
    terms = order + 1.0
    rate, both = excited + felt, 2.0 * np.sqrt(excited * felt)
    apart = np.exp(np.minimum(rate * (terms + 1.0), 300.0)) / (4.0 * terms)
    near = 2.0 * terms**3 * np.exp(0.54 * np.minimum(both * terms, 300.0))
    return 1.0 / (apart + near)


@njit(cache=True)
def _left_out(xi, orders):
    """Error of each sphere's force by the degrees that no chain i - j - k carries, (n,)."""
    n = len(xi)
    out = np.zeros(n)
    for i in range(n):
        for j in range(n):
            for k in range(n):
                if j != i and j != k:
                    order = min(orders[i, j], orders[j, k])
                    out[i] += truncation_error(order, xi[j, k], xi[i, j]) ** 2
    return np.sqrt(out)


@njit(cache=True)
def _choose_orders(distance, tolerance, most):
    """Orders (n, n) and error (n,) of a scene; share by share smaller until the error fits."""
    n = len(distance)
    xi = np.arccosh(distance)
    orders = np.zeros((n, n), dtype=np.int64)
    error = np.zeros(n)
    if n == 1:
        return orders, error
    share = tolerance
    while True:
        complete = True
        for i in range(n):
            for j in range(i):
                # What excites the two: each other, or a third sphere that is closer to either.
                excited = min(np.min(xi[i]), np.min(xi[j]))
                order = orders[i, j]
                while order < most and truncation_error(order, excited, xi[i, j]) > share:
                    order += 1
                orders[i, j] = orders[j, i] = order
                complete &= order == most
        own = _left_out(xi, orders)
        # A wrong force on a neighbour is felt as its Stokeslet: at most 3/2 radius over distance.
        error = own + (0.75 / distance) @ own
        if np.max(error) <= 0.8 * tolerance or complete or share < 1e-6 * tolerance:
            return orders, error
        share *= 0.5


def plan_scene(centres, tolerance: float = 1e-4) -> Plan:
    """Choose the degrees that every pair exchanges.

    centres: (n, 3) [d_p]. tolerance: of the force, relative to an isolated sphere's.
    Raises ValueError for a wrong shape, values that are not finite, overlaps, or a tolerance
    outside [1e-8, 0.1].
    """
    centres = checked_centres(centres)
    if not 1e-8 <= tolerance <= 0.1:
        raise ValueError(f"tolerance {tolerance}: allowed are 1e-8 to 0.1")
    return Plan(centres, *_choose_orders(centre_distances(centres), tolerance, MOST_DEGREE))


@dataclass(frozen=True)
class Response:
    """The answer of a sphere to harmonics: rows of a sparse matrix, and how wrong the mesh is.

    data, indices, starts: the matrix T (compressed rows). deviation: (k,) relative error at each
    degree that is taken from the mesh.
    """

    data: np.ndarray
    indices: np.ndarray
    starts: np.ndarray
    deviation: np.ndarray

    def error(self, gap: float) -> float:
        """What the deviations do to forces at this smallest gap [d_p], relative to a lone sphere's.

        A degree n matters as much as it would be missed.
        """
        return float(self.deviation @ _felt(len(self.deviation), np.arccosh(1.0 + min(gap, 1e100))))


def _felt(degrees: int, xi: float) -> np.ndarray:
    """What leaving each degree out does to the force of a pair, (degrees,); degree 0 is all of it.

    cosh(xi) = distance / d_p, zero for spheres that touch.
    """
    return np.append(1.0, truncation_error(np.arange(degrees - 1.0), xi, xi))[:degrees]


def one_body_response(body: OneBody, tolerance: float) -> Response:
    """The answer T of a sphere to harmonics, for the solve of scenes at this tolerance.

    The spectrum of the single layer on a sphere is known, so it is known how wrong a template is
    at each degree, and what that does to the force where spheres touch. From the first degree at
    which it would do a hundredth of the tolerance, the known spectrum takes over.
    Raises ValueError for a template that does not resolve the lone sphere to 1e-3.
    """
    response = exact_response(MOST_DEGREE)
    count = len(body.response)
    spectrum = single_layer_spectrum(count - 1)
    wrong = np.abs(body.response * spectrum - (spectrum > 0.0)).max(axis=1)
    if wrong[0] > 1e-3:
        raise ValueError(
            f"the template of {len(body.mesh.triangles)} elements is {wrong[0]:.1e} off for a lone "
            "sphere: its edges are too long"
        )
    resolved = int(np.argmin(np.append(wrong * _felt(count, 0.0) <= 0.01 * tolerance, False)))
    response[:resolved] = body.response[:resolved]
    return Response(*response_rows(response), wrong[:resolved])


def response_rows(response) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`response_matrix` as the kernels take it: data, indices and starts of its sparse rows."""
    matrix = response_matrix(response)
    return matrix.data, matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64)


def solve(
    plan: Plan, response: Response, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4
) -> Solution:
    """Solve a planned scene."""
    flow = np.asarray(flow, dtype=float)
    gap = float(centre_distances(plan.centres).min() - 1.0)
    n = len(plan.centres)
    if not np.any(flow):
        return Solution(np.zeros((n, 3)), 0, 0.0, np.zeros(n), gap, CONVERGED)
    # The system's condition grows as the smallest gap closes, and a residual says less.
    strain = np.sqrt(min(gap, 1.0))
    goal = 0.01 * tolerance * strain
    matrix = (response.data, response.indices, response.starts)
    force, iterations, residual = solve_scene(
        plan.centres / RADIUS, flow, plan.orders, matrix, translation_tables(), goal,
        MOST_ITERATIONS,
    )  # fmt: skip
    # The residual is relative to all spheres together, and may sit on one of them.
    estimate = plan.error + response.error(gap) + np.sqrt(n) * residual / strain
    if residual > goal or not np.isfinite(force).all():
        status = NOT_CONVERGED
    else:
        status = CONVERGED if estimate.max() <= tolerance else OUT_OF_REACH
    return Solution(FORCE_UNIT * RADIUS * force, iterations, float(residual), estimate, gap, status)


@cache
def _template_response(tolerance: float):
    """The response of the default template, made on first use and kept for the process."""
    return one_body_response(_template_body(), tolerance)


@cache
def _template_body() -> OneBody:
    return OneBody.from_mesh(sphere_mesh(TEMPLATE_SIZE))


def forces_on_fixed_spheres(centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> np.ndarray:
    """Force on each of n fixed, equal spheres in a uniform Stokes flow.

    centres: (n, 3) in d_p. flow: (3,), velocity far away; forces are made dimensionless by its
    magnitude. tolerance: of the force, relative to that on an isolated sphere, 1e-8 to 0.1.
    Returns (n, 3) in Re_p c_D: an isolated sphere feels 24 along the flow; no flow, no force.
    Raises ValueError if shapes are wrong, values are not finite, or spheres overlap, and
    RuntimeError if GMRES does not converge. Warns where the estimated error exceeds the tolerance.
    """
    flow = checked_flow(flow)
    plan = plan_scene(centres, tolerance)
    speed = np.linalg.norm(flow)
    response = _template_response(tolerance)
    solution = solve(plan, response, flow / speed if speed > 0.0 else flow, tolerance)
    if solution.status == NOT_CONVERGED:
        raise RuntimeError(
            f"GMRES stopped at a residual of {solution.residual:.1e} after "
            f"{solution.iterations} iterations; smallest gap {solution.minimum_gap:.1e} d_p"
        )
    if solution.status == OUT_OF_REACH:
        warnings.warn(
            f"the estimated error, {solution.error_estimate.max():.1e}, exceeds the tolerance, "
            f"{tolerance:.1e}: the smallest gap is {solution.minimum_gap:.1e} d_p",
            RuntimeWarning,
            stacklevel=2,
        )
    return solution.force
