"""Fixed spheres in a uniform Stokes flow: plan a scene, then solve it.

A pair that is far apart is coupled through surface harmonics (`compressed`); a pair that is close
is integrated element by element on the templates of both spheres (`single_layer`), which are
finer the narrower the gap. Sphere i answers with its one-body operator, so the system
f_i + S^-1 sum_j A_ij f_j = S^-1 u_inf is preconditioned by construction and is solved by GMRES.
"""

import warnings
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from dustfall import STOKES_DRAG
from dustfall.stokes.compressed import pair_coupling, pair_rules, solve_scene
from dustfall.stokes.mesh import sphere_mesh
from dustfall.stokes.one_body import HARMONIC_DEGREE, OneBody
from dustfall.stokes.single_layer import RADIUS, cross_interaction

TEMPLATE_SIZES = (0.7, 0.5, 0.35)
"""Edge lengths [radii] of the templates that `forces_on_fixed_spheres` chooses from."""

FORCE_UNIT = STOKES_DRAG / (3.0 * np.pi)
"""Re_p c_D for a force of one mu U d_p: an isolated sphere feels 3 pi mu U d_p."""

MOST_ITERATIONS = 200

CONVERGED, NOT_CONVERGED = 0, 1
"""Status of a record: GMRES reached its residual, or ran out of iterations."""


@dataclass(frozen=True)
class Plan:
    """Which template at which centre, and how each pair is coupled.

    centres: (n, 3) [d_p]. template: (n,) number in the list of templates. orders: (n, n) degree of
    the harmonics that a pair exchanges, NEAR where the pair is integrated element by element.
    error: bound of the relative force error (of 24) from the orders dropped and from the meshes.
    """

    centres: np.ndarray
    template: np.ndarray
    orders: np.ndarray
    error: float


NEAR = -1


@dataclass(frozen=True)
class Solution:
    """Forces (n, 3) [Re_p c_D] and what is known of their quality.

    residual: relative, of the preconditioned system. error_estimate: relative to 24.
    minimum_gap: smallest surface distance of two spheres [d_p], inf for one sphere.
    """

    force: np.ndarray
    iterations: int
    residual: float
    error_estimate: float
    minimum_gap: float
    status: int


def convergence_rate(distance):
    """Exponent by which the force error of each pair falls with every harmonic degree, (n, n).

    distance: (n, n) centre distances [d_p], inf on the diagonal. With cosh(xi) = distance / d_p a
    harmonic of degree l is excited as exp(-xi l) and felt as exp(-xi l), so two lone spheres
    converge as exp(-2 xi) (bispherical coordinates, Stimson and Jeffery 1926). Where a third
    sphere is closer, it is the third that excites the harmonics which the pair exchanges.
    """
    xi = np.arccosh(distance)
    nearest = xi.min(axis=1)
    return xi + np.minimum(xi, np.minimum(nearest[:, None], nearest[None, :]))


ORDER_OFFSET = 1.75
"""Error = exp(-rate (order + offset)): fits two spheres at s = 5 ... 20 radii to a few per cent."""


def mesh_error(size, gap):
    """Relative force error of spheres meshed with edges `size` [radii] at a gap [d_p].

    The traction peaks over a width of sqrt(gap * radius). Measured on three nearly touching spheres
    in a triangle, at gaps from 0.01 to 0.1 d_p, against meshes of half the size.
    """
    ratio = size / np.sqrt(np.maximum(gap, 1e-12) / RADIUS)
    return np.minimum(2e-6 * ratio**4, 5e-5 * ratio)


def plan_scene(centres, sizes=TEMPLATE_SIZES, tolerance: float = 1e-4) -> Plan:
    """Choose the order of every pair and the template of every sphere.

    centres: (n, 3) [d_p]. sizes: edge lengths of the templates [radii], coarsest first.
    tolerance: of the force, relative to an isolated sphere's.
    Raises ValueError for a wrong shape, values that are not finite, overlaps, or a tolerance
    outside [1e-8, 0.1].
    """
    centres = _checked_centres(centres)
    if not 1e-8 <= tolerance <= 0.1:
        raise ValueError(f"tolerance {tolerance}: allowed are 1e-8 to 0.1")
    n = len(centres)
    distance = _distances(centres)
    # Of the tolerance, a third goes to the meshes, the rest in equal parts to a sphere's pairs.
    mesh_share = tolerance / 3.0
    pair_share = (tolerance - mesh_share) / max(n - 1, 1)
    rate = convergence_rate(distance)
    needed = np.ceil(np.log(1.0 / pair_share) / rate - ORDER_OFFSET)
    near = needed > HARMONIC_DEGREE
    orders = np.where(near, NEAR, np.clip(needed, 0, None)).astype(np.int64)
    np.fill_diagonal(orders, 0)
    np.fill_diagonal(near, False)

    gaps = np.where(near, distance - 1.0, np.inf).min(axis=1)
    errors = mesh_error(np.asarray(sizes)[None, :], gaps[:, None])
    fits = errors <= mesh_share
    template = np.where(fits.any(axis=1), fits.argmax(axis=1), len(sizes) - 1)
    template[~near.any(axis=1)] = response_template(sizes)

    dropped = np.where(near, 0.0, np.exp(-rate * (orders + ORDER_OFFSET))).sum(axis=1).max()
    meshed = errors[np.arange(n), template][near.any(axis=1)].max(initial=0.0)
    return Plan(centres, template, orders, float(dropped + meshed))


def response_template(sizes) -> int:
    """The coarsest template with at least twice as many nodes as there are harmonics.

    Its compressed response serves all spheres that have no near neighbour. A template with edges
    of h radii has about 2 * 4 pi / (0.43 h^2) nodes.
    """
    nodes = 8.0 * np.pi / (0.433 * np.asarray(sizes) ** 2)
    enough = nodes >= 2 * (HARMONIC_DEGREE + 1) ** 2
    if not enough.any():
        raise ValueError(f"templates {list(sizes)}: one must have edges of at most 0.48 radii")
    return int(np.argmax(enough))


def solve(plan: Plan, bodies, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> Solution:
    """Solve a planned scene; bodies: the OneBody of every template, in the order of the plan."""
    flow = np.asarray(flow, dtype=float)
    gap = float(_distances(plan.centres).min() - 1.0)
    if not np.any(flow):
        return Solution(np.zeros_like(plan.centres), 0, 0.0, 0.0, gap, CONVERGED)
    goal = 0.01 * tolerance
    if np.any(plan.orders == NEAR):
        force, iterations, residual = _solve_mixed(plan, bodies, flow, goal)
    else:
        response = bodies[plan.template[0]].response
        force, iterations, residual = solve_scene(
            plan.centres, flow, plan.orders, response, *pair_rules(), goal, MOST_ITERATIONS
        )
    status = CONVERGED if residual <= goal and np.isfinite(force).all() else NOT_CONVERGED
    estimate = plan.error + residual
    return Solution(FORCE_UNIT * force, iterations, float(residual), estimate, gap, status)


def _solve_mixed(plan: Plan, bodies, flow, goal):
    """Near spheres carry nodal tractions, the others moments; both kinds in one GMRES."""
    n = len(plan.centres)
    counts, points, harmonics = pair_rules()
    near = plan.orders == NEAR
    body = [bodies[k] for k in plan.template]
    meshed = near.any(axis=1)
    degree = [int(plan.orders[i].max()) for i in range(n)]
    size = [3 * (d + 1) ** 2 for d in degree]
    length = [len(b.factor) if m else s for b, m, s in zip(body, meshed, size, strict=True)]
    ends = np.cumsum(length)
    part = [slice(end - own, end) for end, own in zip(ends, length, strict=True)]

    blocks = {}
    regular, separation = _near_quadrature(goal)
    for i in range(n):
        for j in range(i):
            shift = plan.centres[i] - plan.centres[j]
            if near[i, j]:
                blocks[i, j] = cross_interaction(
                    shift, body[i].mesh, body[j].mesh, regular, separation
                )
            else:
                blocks[i, j] = pair_coupling(shift, plan.orders[i, j], counts, points, harmonics)

    def moments(i, unknown):
        if not meshed[i]:
            return unknown
        nodal = unknown.reshape(-1, 3)
        return (body[i].moments[:, : size[i] // 3].T @ nodal).ravel()

    def answer(i, load, incoming):
        """Unknowns of sphere i for a nodal load and incoming harmonics (either may be None)."""
        if not meshed[i]:
            return body[i].response[: size[i], : size[i]] @ incoming
        spread = (body[i].moments[:, : size[i] // 3] @ incoming.reshape(-1, 3)).ravel()
        return body[i].solve(spread if load is None else spread + load)

    def left(unknowns):
        own = [unknowns[p] for p in part]
        seen = [moments(i, own[i]) for i in range(n)]
        load = [np.zeros(length[i]) if meshed[i] else None for i in range(n)]
        incoming = [np.zeros(s) for s in size]
        for (i, j), block in blocks.items():
            if near[i, j]:
                load[i] += block @ own[j]
                load[j] += own[i] @ block
            else:
                k = len(block)
                incoming[i][:k] += block @ seen[j][:k]
                incoming[j][:k] += seen[i][:k] @ block
        return unknowns + np.concatenate([answer(i, load[i], incoming[i]) for i in range(n)])

    uniform = [np.zeros(s) for s in size]
    for u in uniform:
        u[:3] = np.sqrt(4.0 * np.pi) * flow
    right = np.concatenate([answer(i, None, uniform[i]) for i in range(n)])
    residuals = []
    operator = LinearOperator((ends[-1], ends[-1]), matvec=left, dtype=float)
    solution, _ = gmres(
        operator, right, rtol=goal, restart=MOST_ITERATIONS, maxiter=1,
        callback=residuals.append, callback_type="pr_norm",
    )  # fmt: skip
    residual = np.linalg.norm(left(solution) - right) / np.linalg.norm(right)
    force = np.sqrt(4.0 * np.pi) * np.array([moments(i, solution[part[i]])[:3] for i in range(n)])
    return force, len(residuals), residual


def _near_quadrature(goal: float) -> tuple[int, float]:
    """Gauss points a direction and separation for near pairs.

    Measured on two spheres, s = 2.01 to 10 radii: 3 points leave 3e-5, 4 leave 2e-6, 5 leave 1e-7.
    """
    tolerance = 100.0 * goal
    if tolerance >= 1e-4:
        return 3, 0.5
    return (4, 0.5) if tolerance >= 5e-6 else (5, 1.0)


@cache
def template_body(size: float) -> OneBody:
    """The one-body operator of a template, made on first use and kept for the process."""
    return OneBody.from_mesh(sphere_mesh(size))


class _Bodies:
    """Templates by number, each made when a plan first asks for it."""

    def __getitem__(self, number):
        return template_body(TEMPLATE_SIZES[number])


def forces_on_fixed_spheres(centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4) -> np.ndarray:
    """Force on each of n fixed, equal spheres in a uniform Stokes flow.

    centres: (n, 3) [d_p]. flow: (3,), velocity far away; forces are made dimensionless by its
    magnitude. tolerance: of the force, relative to that on an isolated sphere, 1e-8 to 0.1.
    Returns (n, 3) in Re_p c_D: an isolated sphere feels 24 along the flow; no flow, no force.
    Raises ValueError if shapes are wrong, values are not finite, or spheres overlap, and
    RuntimeError if GMRES does not converge. Warns where the estimated error exceeds the tolerance,
    as it does for gaps below about 0.01 d_p at 1e-4.
    """
    flow = np.asarray(flow, dtype=float)
    if flow.shape != (3,) or not np.isfinite(flow).all():
        raise ValueError(f"flow must be three finite numbers, not {flow.tolist()}")
    plan = plan_scene(centres, TEMPLATE_SIZES, tolerance)
    speed = np.linalg.norm(flow)
    solution = solve(plan, _Bodies(), flow / speed if speed > 0.0 else flow, tolerance)
    if solution.status != CONVERGED:
        raise RuntimeError(
            f"GMRES stopped at a residual of {solution.residual:.1e} after "
            f"{solution.iterations} iterations; smallest gap {solution.minimum_gap:.1e} d_p"
        )
    # Orders, meshes and residual may use up the tolerance and a hundredth, when all goes well.
    if solution.error_estimate > 1.02 * tolerance:
        warnings.warn(
            f"the estimated error, {solution.error_estimate:.1e}, exceeds the tolerance, "
            f"{tolerance:.1e}: the smallest gap is {solution.minimum_gap:.1e} d_p",
            RuntimeWarning,
            stacklevel=2,
        )
    return solution.force


def _checked_centres(centres) -> np.ndarray:
    centres = np.ascontiguousarray(centres, dtype=float)
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise ValueError(f"centres must have the shape (n, 3) with n >= 1, not {centres.shape}")
    bad = np.flatnonzero(~np.isfinite(centres).all(axis=1))
    if len(bad):
        raise ValueError(f"centre of sphere {bad[0]} is not finite: {centres[bad[0]].tolist()}")
    distance = _distances(centres)
    i, j = np.unravel_index(distance.argmin(), distance.shape)
    if distance[i, j] <= 1.0:
        raise ValueError(
            f"spheres {i} and {j} overlap or touch: their centres are {distance[i, j]:.6g} d_p "
            "apart, more than 1 is needed"
        )
    return centres


def _distances(centres) -> np.ndarray:
    """(n, n) centre distances, inf on the diagonal."""
    difference = centres[:, None, :] - centres[None, :, :]
    distance = np.sqrt((difference**2).sum(axis=2))
    np.fill_diagonal(distance, np.inf)
    return distance
