"""Spheres that see each other through surface harmonics.

The unknowns are the traction moments q_i of each sphere. The incoming flow at sphere i is that of
infinity less that of the others, so q_i = T (u_inf - sum_j K_ij q_j) with the one-body response T
and the couplings K_ij of `translation`. The series of a pair converges geometrically, so each pair
exchanges no more degrees than its distance and the tolerance ask for. GMRES solves the system,
which the response preconditions by construction.
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


@njit(cache=True)
def _add_forces(coupling, begin, moments, i, j, incoming):
    """`_add_pair` for degree 0 alone: rows i and j of moments and incoming, (total, 3)."""
    for a in range(3):
        for b in range(3):
            v = coupling[begin + 3 * a + b]
            incoming[i, a] += v * moments[j, b]
            incoming[j, a] += v * moments[i, b]


@njit(cache=True)
def _add_pair(degree, turns, coupling, tables, q_i, q_j, u_i, u_j, field, spare, lines):
    """Add to u_i, u_j the velocity that the traction of either sphere makes on the other."""
    k = (degree + 1) ** 2
    for source, line in ((q_i, lines[0]), (q_j, lines[1])):
        field[:k] = source[:k]
        turn_to_axis(degree, turns, tables, field, spare)
        gather_azimuthal(degree, field, line)
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
    for target, line in ((u_i, at_i), (u_j, at_j)):
        scatter_azimuthal(degree, line, field)
        turn_from_axis(degree, turns, tables, field, spare)
        target[:k] += field[:k]


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


@njit(cache=True)
def couple_scene(centres, degrees, tables):
    """Everything about a scene that the iterations need, from centres (n, 3) [radii].

    degrees: (n, n) symmetric, of each pair. Returns the highest degree (n,) and the first harmonic
    (n + 1,) of the spheres; for all pairs j < i, row by row, one after the other, `turns_to` their
    directions and their couplings, and where those of each pair begin.
    """
    n = len(centres)
    highest = np.zeros(n, dtype=np.int64)
    starts = np.zeros(n + 1, dtype=np.int64)
    for i in range(n):
        for j in range(n):
            if j != i:
                highest[i] = max(highest[i], degrees[i, j])
        starts[i + 1] = starts[i] + (highest[i] + 1) ** 2
    count = n * (n - 1) // 2
    begin, p = np.zeros((count + 1, 2), dtype=np.int64), 0
    for i in range(n):
        for j in range(i):
            degree = degrees[i, j]
            begin[p + 1, 0] = begin[p, 0] + (4 * (degree + 2) if degree > 0 else 0)
            begin[p + 1, 1] = begin[p, 1] + (block_sizes(degree)[1] if degree > 0 else 9)
            p += 1
    turns, couplings, p = np.empty(begin[count, 0]), np.empty(begin[count, 1]), 0
    for i in range(n):
        for j in range(i):
            degree = degrees[i, j]
            coupling = couplings[begin[p, 1] : begin[p + 1, 1]]
            if degree == 0:
                put_coupling_of_forces(centres[i], centres[j], coupling)
            else:
                apart = centres[i] - centres[j]
                distance = np.sqrt(np.sum(apart**2))
                turns[begin[p, 0] : begin[p + 1, 0]] = turns_to(degree, apart / distance).ravel()
                coupling[:] = axial_coupling(degree, distance, tables)
            p += 1
    return highest, starts, turns, couplings, begin


@njit(cache=True)
def apply_system(moments, scene, degrees, response, tables, out):
    """out = moments + T sum_j K_ij moments_j, for moments (total, 3) of a coupled scene."""
    highest, starts, turns, couplings, begin = scene
    largest = (np.max(highest) + 1) ** 2
    incoming = np.zeros(moments.shape)
    field, spare = np.empty((largest, 3)), np.empty((largest, 3))
    lines = np.empty((4, 3 * largest, 2))
    p = 0
    for i in range(len(highest)):
        for j in range(i):
            degree = degrees[i, j]
            if degree == 0:
                _add_forces(couplings, begin[p, 1], moments, starts[i], starts[j], incoming)
            else:
                own, other = (starts[i], starts[i + 1]), (starts[j], starts[j + 1])
                _add_pair(
                    degree,
                    turns[begin[p, 0] : begin[p + 1, 0]].reshape(4, degree + 2),
                    couplings[begin[p, 1] : begin[p + 1, 1]],
                    tables,
                    moments[own[0] : own[1]],
                    moments[other[0] : other[1]],
                    incoming[own[0] : own[1]],
                    incoming[other[0] : other[1]],
                    field,
                    spare,
                    lines,
                )
            p += 1
    out[:] = moments
    for i in range(len(highest)):
        u, q = incoming[starts[i] : starts[i + 1]], out[starts[i] : starts[i + 1]]
        _respond(highest[i], response, u, q)


@njit(cache=True)
def solve_scene(centres, flow, degrees, response, tables, tolerance, most):
    """GMRES for one scene; returns forces, iterations and relative residual.

    centres: (n, 3) [radii]. degrees: (n, n) symmetric degree of each pair. response: data, indices
    and row starts of T. most: largest number of iterations.
    Forces (n, 3) are in units of mu, flow and radius.
    """
    n = len(centres)
    scene = couple_scene(centres, degrees, tables)
    highest, starts = scene[0], scene[1]
    uniform, right = np.zeros((starts[n], 3)), np.zeros((starts[n], 3))
    for i in range(n):
        uniform[starts[i]] = np.sqrt(4.0 * np.pi) * flow
        u, q = uniform[starts[i] : starts[i + 1]], right[starts[i] : starts[i + 1]]
        _respond(highest[i], response, u, q)
    iterations, residual = 0, 0.0
    solution = right
    if n > 1:
        krylov = started(right.ravel(), most)
        basis, norm = krylov[0], krylov[3][0]
        residual = 1.0
        while iterations < most and residual > tolerance:
            old = basis[iterations].reshape(right.shape)
            new = basis[iterations + 1].reshape(right.shape)
            apply_system(old, scene, degrees, response, tables, new)
            residual = extended(krylov, iterations) / norm
            iterations += 1
        solution = combined(krylov, iterations).reshape(right.shape)
    forces = np.empty((n, 3))
    for i in range(n):
        forces[i] = np.sqrt(4.0 * np.pi) * solution[starts[i]]
    return forces, iterations, residual
