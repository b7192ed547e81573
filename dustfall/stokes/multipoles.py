"""Spheres that see each other through surface harmonics.

The unknowns are the traction moments q_i of each sphere, over its radius a_i, which makes those of
all spheres alike in size. The incoming flow at sphere i is that of infinity less that of the
others, so q_i = T (u_inf - sum_j K_ij a_j q_j) with the one-body response T of a sphere of radius 1
and the couplings K_ij of `translation`. The series of a pair converges geometrically, so each pair
exchanges no more degrees than its distance and the tolerance ask for; a close pair has the coupling
of `close_pairs` instead, which holds all degrees beyond. GMRES solves the system, which the
response preconditions by construction.
"""

import numpy as np
from numba import njit

from dustfall.stokes.gmres import combined, extended, started
from dustfall.stokes.translation import (
    axial_coupling,
    block_size,
    block_sizes,
    gather_azimuthal,
    put_coupling_of_forces,
    scatter_azimuthal,
    turn_from_axis,
    turn_to_axis,
    turns_to,
)

AXES = (1, 2, 0)
"""Coordinate of each harmonic of degree 1."""


@njit(cache=True)
def _add_forces(coupling, begin, moments, i, j, incoming):
    """`_add_pair` for degree 0 alone: rows i and j of moments and incoming, (total, 3)."""
    for a in range(3):
        for b in range(3):
            v = coupling[begin + 3 * a + b]
            incoming[i, a] += v * moments[j, b]
            incoming[j, a] += v * moments[i, b]


@njit(cache=True)
def _add_first_moments(x, y, z, squares, q, u):
    """Add to u (4, 3) the harmonics of degrees 0 and 1 that moments q (4, 3) make, at x, y, z.

    squares: of the radii there, and of the moments' sphere. Exact, as the coupling of degree 1 is:
    a Stokeslet G and its gradient with the Faxen parts of both spheres, c laplacian G, where c is
    a^2 / 6 for degree 0 and a^2 / 10 for degree 1 (Kim and Karrila 1991, chapter 2).
    """
    here, there = squares
    inverse = 1.0 / (x * x + y * y + z * z)
    # 4 pi by the harmonics of 1, over 8 pi; a coordinate's are a root of 3 smaller.
    scale = 0.5 * np.sqrt(inverse)
    a, b = np.sqrt(here / 3.0), np.sqrt(there / 3.0)
    r, force = (x, y, z), (q[0, 0], q[0, 1], q[0, 2])
    by_force = x * force[0] + y * force[1] + z * force[2]
    # First moments: component of the traction, coordinate.
    xx, xy, xz = b * q[3, 0], b * q[1, 0], b * q[2, 0]
    yx, yy, yz = b * q[3, 1], b * q[1, 1], b * q[2, 1]
    zx, zy, zz = b * q[3, 2], b * q[1, 2], b * q[2, 2]
    d = ((xx, xy, xz), (yx, yy, yz), (zx, zy, zz))
    trace = xx + yy + zz
    out = (xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z)
    back = (xx * x + yx * y + zx * z, xy * x + yy * y + zy * z, xz * x + yz * y + zz * z)
    twice = x * out[0] + y * out[1] + z * out[2]

    c = (here + there) / 6.0 * inverse
    alpha, beta = 1.0 + 2.0 * c, (1.0 - 6.0 * c) * inverse
    e = (here / 6.0 + there / 10.0) * inverse
    alpha_1, beta_1 = -(1.0 + 6.0 * e) * inverse, -(3.0 - 30.0 * e) * inverse**2
    beta_0 = (1.0 - 6.0 * e) * inverse
    along = beta * by_force - beta_1 * twice - beta_0 * trace
    for i in range(3):
        u[0, i] += scale * (alpha * force[i] - alpha_1 * out[i] - beta_0 * back[i] + along * r[i])
    e = (here / 10.0 + there / 6.0) * inverse
    alpha_1, beta_1 = -(1.0 + 6.0 * e) * inverse, -(3.0 - 30.0 * e) * inverse**2
    beta_0 = (1.0 - 6.0 * e) * inverse
    c = (here + there) / 10.0 * inverse
    beta, gamma_1 = (1.0 - 6.0 * c) * inverse, -(1.0 + 6.0 * c) * inverse
    delta_1 = -(3.0 - 30.0 * c) * inverse**2
    gamma_2 = (3.0 + 30.0 * c) * inverse**2
    delta_2 = (15.0 - 210.0 * c) * inverse**3
    both = beta_1 * by_force - delta_2 * twice - delta_1 * trace
    isotropic = beta_0 * by_force - delta_1 * twice - beta * trace
    for k in range(3):
        m = AXES[k]
        for i in range(3):
            value = r[m] * (alpha_1 * force[i] - gamma_2 * out[i] - delta_1 * back[i] + both * r[i])
            value += r[i] * (beta_0 * force[m] - delta_1 * (out[m] + back[m]))
            value -= gamma_1 * d[i][m] + beta * d[m][i]
            if m == i:
                value += isotropic
            u[1 + k, i] += scale * a * value


@njit(cache=True)
def _add_pair(degree, close, turns, coupling, tables, q_i, q_j, u_i, u_j, field, spare, lines):
    """Add to u_i, u_j the velocity that the traction of either sphere makes on the other.

    On a close pair's spheres it comes back as well.
    """
    k = (degree + 1) ** 2
    for source, line in ((q_i, lines[0]), (q_j, lines[1])):
        field[:k] = source[:k]
        turn_to_axis(degree, turns, tables, field, spare)
        gather_azimuthal(degree, field, line)
    if close:
        _multiply_both(degree, coupling, lines)
    else:
        _multiply(degree, coupling, lines)
    for target, line in ((u_i, lines[2]), (u_j, lines[3])):
        scatter_azimuthal(degree, line, field)
        turn_from_axis(degree, turns, tables, field, spare)
        target[:k] += field[:k]


@njit(cache=True)
def _multiply(degree, coupling, lines):
    """Multiply moments of i and j, lines 0 and 1, by the coupling: velocities, lines 2 and 3."""
    from_i, from_j, at_i, at_j = lines
    begin = first = 0
    for total in range(degree + 2):
        size = block_size(degree, total)
        # The coupling seen from j is the transpose.
        at_j[first : first + size] = 0.0
        for row in range(size):
            a, b = 0.0, 0.0
            x, y = from_i[first + row, 0], from_i[first + row, 1]
            for column in range(size):
                v = coupling[begin + row * size + column]
                a += v * from_j[first + column, 0]
                b += v * from_j[first + column, 1]
                at_j[first + column, 0] += v * x
                at_j[first + column, 1] += v * y
            at_i[first + row, 0], at_i[first + row, 1] = a, b
        begin += size * size
        first += size


@njit(cache=True)
def _multiply_both(degree, coupling, lines):
    """As `_multiply`, by the symmetric matrices of `effective_coupling`."""
    begin = first = 0
    for total in range(degree + 2):
        size = block_size(degree, total)
        for row in range(2 * size):
            a = b = 0.0
            for column in range(2 * size):
                v = coupling[begin + row * 2 * size + column]
                half, place = (0, column) if column < size else (1, column - size)
                a += v * lines[half, first + place, 0]
                b += v * lines[half, first + place, 1]
            half, place = (2, row) if row < size else (3, row - size)
            lines[half, first + place, 0], lines[half, first + place, 1] = a, b
        begin += 4 * size * size
        first += size


@njit(cache=True)
def _respond(degree, response, incoming, out):
    """out += T incoming, for fields (k, 3)."""
    data, indices, begin = response
    incoming, out = incoming.reshape(-1), out.reshape(-1)
    for row in range(3 * (degree + 1) ** 2):
        total = 0.0
        for p in range(begin[row], begin[row + 1]):
            total += data[p] * incoming[indices[p]]
        out[row] += total


NO_CLOSE_PAIRS = np.zeros((0, 0), dtype=np.bool_), np.zeros(0)
"""For `couple_scene`."""


@njit(cache=True)
def couple_scene(centres, radii, degrees, least, close_pairs, tables):
    """Everything about a scene that the iterations need.

    centres: (n, 3), radii: (n,), in one unit. degrees: (n, n) symmetric, of each pair. least:
    degree that every sphere has at least. close_pairs: (n, n), which pairs j < i are close, or
    (0, 0) where none is; and their effective couplings, row by row one after the other.
    Returns centres, radii, degrees, the highest degree (n,) and the first harmonic (n + 1,) of the
    spheres; for all pairs j < i, row by row, one after the other, whether they are close,
    `turns_to` their directions and their couplings, and where those of each pair begin. A pair of
    degree 1 that is not close has none of these: its few moments cost less than they do.
    """
    n = len(centres)
    highest = np.full(n, least)
    starts = np.zeros(n + 1, dtype=np.int64)
    for i in range(n):
        for j in range(n):
            if j != i:
                highest[i] = max(highest[i], degrees[i, j])
        starts[i + 1] = starts[i] + (highest[i] + 1) ** 2
    count = n * (n - 1) // 2
    which, effective = close_pairs
    close = np.zeros(count, dtype=np.bool_)
    begin, p = np.zeros((count + 1, 2), dtype=np.int64), 0
    for i in range(n):
        for j in range(i):
            degree = degrees[i, j]
            close[p] = len(which) > 0 and which[i, j]
            turned = degree > 1 or close[p]
            entries = 9 if degree == 0 else 0
            if turned:
                entries = (4 if close[p] else 1) * block_sizes(degree)[1]
            begin[p + 1, 0] = begin[p, 0] + (4 * (degree + 2) if turned else 0)
            begin[p + 1, 1] = begin[p, 1] + entries
            p += 1
    turns, couplings, p, taken = np.empty(begin[count, 0]), np.empty(begin[count, 1]), 0, 0
    for i in range(n):
        for j in range(i):
            degree, both = degrees[i, j], (radii[i], radii[j])
            coupling = couplings[begin[p, 1] : begin[p + 1, 1]]
            if degree == 0:
                put_coupling_of_forces(centres[i], centres[j], both, coupling)
            elif len(coupling) > 0:
                apart = centres[i] - centres[j]
                distance = np.sqrt(np.sum(apart**2))
                turns[begin[p, 0] : begin[p + 1, 0]] = turns_to(degree, apart / distance).ravel()
                if close[p]:
                    coupling[:] = effective[taken : taken + len(coupling)]
                    taken += len(coupling)
                else:
                    coupling[:] = axial_coupling(degree, distance, both, tables)
            p += 1
    return centres, radii, degrees, highest, starts, close, turns, couplings, begin


@njit(cache=True)
def incoming_flow(moments, scene, tables):
    """sum_j K_ij a_j moments_j, (total, 3): what the others' tractions make on each sphere."""
    centres, radii, degrees, highest, starts, close, turns, couplings, begin = scene
    largest = (np.max(highest) + 1) ** 2
    incoming, whole = np.zeros(moments.shape), np.empty(moments.shape)
    for i in range(len(highest)):
        whole[starts[i] : starts[i + 1]] = radii[i] * moments[starts[i] : starts[i + 1]]
    field, spare = np.empty((largest, 3)), np.empty((largest, 3))
    lines = np.empty((4, 3 * largest, 2))
    p = 0
    for i in range(len(highest)):
        for j in range(i):
            degree = degrees[i, j]
            if degree == 0:
                _add_forces(couplings, begin[p, 1], whole, starts[i], starts[j], incoming)
            elif degree == 1 and not close[p]:
                x, y, z = centres[i] - centres[j]
                a, b = radii[i] ** 2, radii[j] ** 2
                _add_first_moments(
                    x, y, z, (a, b), whole[starts[j] : starts[j] + 4],
                    incoming[starts[i] : starts[i] + 4],
                )  # fmt: skip
                _add_first_moments(
                    -x, -y, -z, (b, a), whole[starts[i] : starts[i] + 4],
                    incoming[starts[j] : starts[j] + 4],
                )  # fmt: skip
            else:
                own, other = (starts[i], starts[i + 1]), (starts[j], starts[j + 1])
                _add_pair(
                    degree,
                    close[p],
                    turns[begin[p, 0] : begin[p + 1, 0]].reshape(4, degree + 2),
                    couplings[begin[p, 1] : begin[p + 1, 1]],
                    tables,
                    whole[own[0] : own[1]],
                    whole[other[0] : other[1]],
                    incoming[own[0] : own[1]],
                    incoming[other[0] : other[1]],
                    field,
                    spare,
                    lines,
                )
            p += 1
    return incoming


@njit(cache=True)
def add_responses(flow, scene, response, out):
    """out += T flow, sphere by sphere, for fields (total, 3) of a coupled scene."""
    _, _, _, highest, starts, _, _, _, _ = scene
    for i in range(len(highest)):
        u, q = flow[starts[i] : starts[i + 1]], out[starts[i] : starts[i + 1]]
        _respond(highest[i], response, u, q)


@njit(cache=True)
def apply_system(moments, scene, response, tables, out):
    """out = moments + T sum_j K_ij a_j moments_j, for moments (total, 3) of a coupled scene."""
    out[:] = moments
    add_responses(incoming_flow(moments, scene, tables), scene, response, out)


@njit(cache=True)
def solve_system(right, guess, scene, response, tables, tolerance, most):
    """GMRES for the moments (total, 3) of a coupled scene.

    right: (total, 3), not zero. guess: the same, where to start. most: largest number of
    iterations. Returns moments, iterations and the residual, relative to `right`.
    """
    norm = np.linalg.norm(right)
    missing = right
    if np.any(guess):
        image = np.empty(right.shape)
        apply_system(guess, scene, response, tables, image)
        missing = right - image
    residual = np.linalg.norm(missing) / norm
    if residual <= tolerance:
        return guess, 0, residual
    krylov, iterations = started(missing.ravel(), most), 0
    basis = krylov[0]
    while iterations < most and residual > tolerance:
        old = basis[iterations].reshape(right.shape)
        new = basis[iterations + 1].reshape(right.shape)
        apply_system(old, scene, response, tables, new)
        residual = extended(krylov, iterations) / norm
        iterations += 1
    return guess + combined(krylov, iterations).reshape(right.shape), iterations, residual


@njit(cache=True)
def solve_scene(centres, flow, degrees, response, tables, tolerance, most):
    """Fixed, equal spheres in a uniform flow; returns forces, iterations and relative residual.

    centres: (n, 3) [radii]. degrees: (n, n) symmetric degree of each pair. response: data, indices
    and row starts of T. most: largest number of iterations.
    Forces (n, 3) are in units of mu, flow and radius.
    """
    n = len(centres)
    none = (np.zeros((0, 0), dtype=np.bool_), np.zeros(0))
    scene = couple_scene(centres, np.ones(n), degrees, 0, none, tables)
    starts = scene[4]
    uniform, right = np.zeros((starts[n], 3)), np.zeros((starts[n], 3))
    for i in range(n):
        uniform[starts[i]] = np.sqrt(4.0 * np.pi) * flow
    add_responses(uniform, scene, response, right)
    solution, iterations, residual = right, 0, 0.0
    if n > 1:
        guess = np.zeros(right.shape)
        solution, iterations, residual = solve_system(
            right, guess, scene, response, tables, tolerance, most
        )
    forces = np.empty((n, 3))
    for i in range(n):
        forces[i] = np.sqrt(4.0 * np.pi) * solution[starts[i]]
    return forces, iterations, residual
