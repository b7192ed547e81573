"""Spheres that see each other through surface harmonics.

The unknowns are the traction moments q_i of each sphere. The incoming flow at sphere i is that of
infinity less that of the others, so q_i = T (u_inf - sum_j K_ij q_j) with the one-body response T
and the couplings K_ij of `translation`. The series of a pair converges geometrically, so each pair
exchanges no more degrees than its distance and the tolerance ask for. GMRES solves the system,
which the response preconditions by construction.
"""

import numpy as np
from numba import njit

from dustfall.stokes.translation import (
    axial_coupling,
    block_sizes,
    gather_azimuthal,
    scatter_azimuthal,
    turn_from_axis,
    turn_to_axis,
)


@njit(cache=True)
def _add_pair(order, polar, azimuth, coupling, tables, q_i, q_j, u_i, u_j, field, spare, lines):
    """Add to u_i, u_j the velocity that the traction of either sphere makes on the other."""
    k = (order + 1) ** 2
    for source, line in ((q_i, lines[0]), (q_j, lines[1])):
        field[:k] = source[:k]
        turn_to_axis(order, polar, azimuth, tables, field, spare)
        gather_azimuthal(order, field, line)
    from_i, from_j, at_i, at_j = lines
    begin = first = 0
    for size in block_sizes(order):
        for row in range(size):
            a, b = 0.0, 0.0
            x, y = from_i[first + row, 0], from_i[first + row, 1]
            for column in range(size):
                v = coupling[begin + row * size + column]
                a += v * from_j[first + column, 0]
                b += v * from_j[first + column, 1]
            at_i[first + row, 0], at_i[first + row, 1] = a, b
        # The coupling seen from j is the transpose.
        at_j[first : first + size] = 0.0
        for row in range(size):
            x, y = from_i[first + row, 0], from_i[first + row, 1]
            for column in range(size):
                v = coupling[begin + row * size + column]
                at_j[first + column, 0] += v * x
                at_j[first + column, 1] += v * y
        begin += size * size
        first += size
    for target, line in ((u_i, at_i), (u_j, at_j)):
        scatter_azimuthal(order, line, field)
        turn_from_axis(order, polar, azimuth, tables, field, spare)
        target[:k] += field[:k]


@njit(cache=True)
def _respond(degree, response, incoming, out):
    """out += T incoming, for fields (k, 3)."""
    data, indices, begin = response
    for row in range(3 * (degree + 1) ** 2):
        total = 0.0
        for p in range(begin[row], begin[row + 1]):
            column = indices[p]
            total += data[p] * incoming[column // 3, column % 3]
        out[row // 3, row % 3] += total


@njit(cache=True)
def couple_scene(centres, orders, tables):
    """Everything about a scene that the iterations need, from centres (n, 3) [radii].

    orders: (n, n) symmetric degree of each pair. Returns degrees (n,) and first harmonics (n + 1,)
    of the spheres; direction (polar angle, azimuth) and coupling of each pair j < i, row by row.
    """
    n = len(centres)
    degrees = np.zeros(n, dtype=np.int64)
    starts = np.zeros(n + 1, dtype=np.int64)
    for i in range(n):
        for j in range(n):
            if j != i:
                degrees[i] = max(degrees[i], orders[i, j])
        starts[i + 1] = starts[i] + (degrees[i] + 1) ** 2
    count = n * (n - 1) // 2
    angles, p = np.empty((count, 2)), 0
    couplings = [np.empty(0) for _ in range(count)]
    for i in range(n):
        for j in range(i):
            x, y, z = centres[i] - centres[j]
            across = np.sqrt(x * x + y * y)
            angles[p] = np.arctan2(across, z), np.arctan2(y, x)
            distance = np.sqrt(across**2 + z * z)
            couplings[p] = axial_coupling(orders[i, j], distance, tables)
            p += 1
    return degrees, starts, angles, couplings


@njit(cache=True)
def apply_system(moments, scene, orders, response, tables, out):
    """out = moments + T sum_j K_ij moments_j, for moments (total, 3) of a coupled scene."""
    degrees, starts, angles, couplings = scene
    largest = (np.max(degrees) + 1) ** 2
    incoming = np.zeros(moments.shape)
    field, spare = np.empty((largest, 3)), np.empty((largest, 3))
    lines = np.empty((4, 3 * largest, 2))
    p = 0
    for i in range(len(degrees)):
        for j in range(i):
            _add_pair(
                orders[i, j], angles[p, 0], angles[p, 1], couplings[p], tables,
                moments[starts[i] : starts[i + 1]], moments[starts[j] : starts[j + 1]],
                incoming[starts[i] : starts[i + 1]], incoming[starts[j] : starts[j + 1]],
                field, spare, lines,
            )  # fmt: skip
            p += 1
    out[:] = moments
    for i in range(len(degrees)):
        own = slice(starts[i], starts[i + 1])
        _respond(degrees[i], response, incoming[own], out[own])


@njit(cache=True)
def solve_scene(centres, flow, orders, response, tables, tolerance, most):
    """GMRES for one scene; returns forces, iterations and relative residual.

    centres: (n, 3) [radii]. orders: (n, n) symmetric degree of each pair. response: data, indices
    and row starts of T. most: largest number of iterations.
    Forces (n, 3) are in units of mu, flow and radius.
    """
    n = len(centres)
    scene = couple_scene(centres, orders, tables)
    degrees, starts = scene[0], scene[1]
    uniform, right = np.zeros((starts[n], 3)), np.zeros((starts[n], 3))
    for i in range(n):
        uniform[starts[i]] = np.sqrt(4.0 * np.pi) * flow
        own = slice(starts[i], starts[i + 1])
        _respond(degrees[i], response, uniform[own], right[own])
    solution, iterations, residual = np.zeros_like(right), 0, 0.0
    if n > 1:
        # Not zeroed: most iterations never come, and clearing their memory costs more than a scene.
        basis = np.empty((most + 1, *right.shape))
        hessenberg = np.empty((most + 1, most))
        cosines, sines, target = np.empty(most), np.empty(most), np.empty(most + 1)
        norm = np.sqrt(np.sum(right**2))
        basis[0] = right / norm
        target[0] = norm
        residual = 1.0
        while iterations < most and residual > tolerance:
            k = iterations
            apply_system(basis[k], scene, orders, response, tables, basis[k + 1])
            for i in range(k + 1):
                h = np.sum(basis[i] * basis[k + 1])
                hessenberg[i, k] = h
                basis[k + 1] -= h * basis[i]
            length = np.sqrt(np.sum(basis[k + 1] ** 2))
            if length > 0.0:
                basis[k + 1] /= length
            for i in range(k):
                h = hessenberg[i, k]
                hessenberg[i, k] = cosines[i] * h + sines[i] * hessenberg[i + 1, k]
                hessenberg[i + 1, k] = cosines[i] * hessenberg[i + 1, k] - sines[i] * h
            h = hessenberg[k, k]
            radius = np.sqrt(h * h + length * length)
            cosines[k], sines[k] = h / radius, length / radius
            hessenberg[k, k] = radius
            target[k + 1] = -sines[k] * target[k]
            target[k] *= cosines[k]
            iterations += 1
            residual = abs(target[iterations]) / norm
        weights = np.zeros(iterations)
        for i in range(iterations - 1, -1, -1):
            value = target[i]
            for j in range(i + 1, iterations):
                value -= hessenberg[i, j] * weights[j]
            weights[i] = value / hessenberg[i, i]
        for i in range(iterations):
            solution += weights[i] * basis[i]
    else:
        solution[:] = right
    forces = np.empty((n, 3))
    for i in range(n):
        forces[i] = np.sqrt(4.0 * np.pi) * solution[starts[i]]
    return forces, iterations, residual
