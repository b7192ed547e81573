"""Spheres that see each other through few surface harmonics.

The unknowns are the moments q_i of each sphere; the incoming flow at sphere i is that of the
others and of infinity, q_i = T (u_inf - sum_j K_ij q_j). K_ij takes moments on sphere j to surface
harmonics of the velocity on sphere i; it is integrated by a Lebedev rule on both spheres. The
series of a pair converges geometrically in the inverse distance, so each pair gets the order that
its distance and the tolerance ask for. The system is solved by GMRES.
"""

from functools import cache

import numpy as np
from numba import njit

from dustfall.stokes.harmonics import real_harmonics
from dustfall.stokes.one_body import HARMONIC_DEGREE
from dustfall.stokes.quadrature import sphere_rule
from dustfall.stokes.single_layer import RADIUS, put_block, stokeslet


@cache
def pair_rules() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For each order: number of points (k,), points (k, q, 3), weighted harmonics (k, q, lm)."""
    rules = [sphere_rule(max(3, 2 * order + 1)) for order in range(HARMONIC_DEGREE + 1)]
    counts = np.array([len(weights) for _, weights in rules])
    points = np.zeros((len(rules), counts.max(), 3))
    harmonics = np.zeros((len(rules), counts.max(), (HARMONIC_DEGREE + 1) ** 2))
    for order, (x, weights) in enumerate(rules):
        points[order, : len(x)] = x
        values = weights[:, None] * real_harmonics(order, x)
        harmonics[order, : len(x), : values.shape[1]] = values
    return counts, points, harmonics


@njit(cache=True)
def pair_coupling(shift, order, counts, points, harmonics):
    """K (3k, 3k), k = (order + 1)^2, for the centre distance `shift` = target - source [d_p]."""
    count, size = counts[order], (order + 1) ** 2
    x, y = points[order], harmonics[order]
    g = np.empty(6)
    half = np.zeros((count, size, 6))
    for p in range(count):
        for q in range(count):
            stokeslet(
                shift[0] + RADIUS * (x[p, 0] - x[q, 0]),
                shift[1] + RADIUS * (x[p, 1] - x[q, 1]),
                shift[2] + RADIUS * (x[p, 2] - x[q, 2]),
                g,
            )
            for b in range(size):
                for k in range(6):
                    half[p, b, k] += g[k] * y[q, b]
    out = np.zeros((3 * size, 3 * size))
    entry = np.empty(6)
    for a in range(size):
        for b in range(size):
            entry[:] = 0.0
            for p in range(count):
                for k in range(6):
                    entry[k] += y[p, a] * half[p, b, k]
            entry /= 8.0 * np.pi
            put_block(out, a, b, entry)
    return out


@njit(cache=True)
def _scattered(sizes, starts, orders, blocks, response, moments, out):
    """out = moments + T K moments: the left side of the system."""
    n = len(sizes)
    incoming = np.zeros(len(moments))
    pair = 0
    for i in range(n):
        for j in range(i):
            size = 3 * (orders[i, j] + 1) ** 2
            block = blocks[pair]
            pair += 1
            si, sj = starts[i], starts[j]
            for a in range(size):
                total = 0.0
                mine = moments[si + a]
                for b in range(size):
                    total += block[a, b] * moments[sj + b]
                    incoming[sj + b] += block[a, b] * mine
                incoming[si + a] += total
    for i in range(n):
        s = starts[i]
        for a in range(sizes[i]):
            total = 0.0
            for b in range(sizes[i]):
                total += response[a, b] * incoming[s + b]
            out[s + a] = moments[s + a] + total


@njit(cache=True)
def solve_scene(centres, flow, orders, response, counts, points, harmonics, tolerance, most):
    """GMRES for one scene; returns forces (n, 3) [d_p, mu = 1], iterations, relative residual.

    orders: (n, n) symmetric order of each pair; most: largest number of iterations.
    """
    n = len(centres)
    sizes = np.empty(n, dtype=np.int64)
    for i in range(n):
        largest = 0
        for j in range(n):
            if j != i:
                largest = max(largest, orders[i, j])
        sizes[i] = 3 * (largest + 1) ** 2
    starts = np.zeros(n + 1, dtype=np.int64)
    starts[1:] = np.cumsum(sizes)
    blocks = [
        pair_coupling(centres[i] - centres[j], orders[i, j], counts, points, harmonics)
        for i in range(n)
        for j in range(i)
    ]
    total = starts[n]
    right = np.zeros(total)
    for i in range(n):
        for a in range(sizes[i]):
            for c in range(3):
                right[starts[i] + a] += response[a, c] * flow[c] * np.sqrt(4.0 * np.pi)
    solution, iterations, residual = np.zeros(total), 0, 0.0
    if n > 1:
        basis = np.zeros((most + 1, total))
        hessenberg = np.zeros((most + 1, most))
        cosines, sines, target = np.zeros(most), np.zeros(most), np.zeros(most + 1)
        norm = np.sqrt(np.sum(right**2))
        basis[0] = right / norm
        target[0] = norm
        residual = 1.0
        while iterations < most and residual > tolerance:
            k = iterations
            _scattered(sizes, starts, orders, blocks, response, basis[k], basis[k + 1])
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
        solution = right
    forces = np.empty((n, 3))
    for i in range(n):
        forces[i] = np.sqrt(4.0 * np.pi) * solution[starts[i] : starts[i] + 3]
    return forces, iterations, residual
