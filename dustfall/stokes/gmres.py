"""GMRES (Saad and Schultz 1986), compiled: a scene takes less time than a call of scipy's.

The caller applies its operator, so that one compiled loop holds both:

    krylov = started(right, most)
    while krylov's residual is too large:
        apply the operator to basis[k] and write basis[k + 1]
        residual = extended(krylov, k)
    solution = combined(krylov, iterations)
"""

import numpy as np
from numba import njit


@njit(cache=True, fastmath={"reassoc"})
def _product(a, b):
    """Scalar product; summed in the order that vector instructions like, alike for all threads."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@njit(cache=True)
def started(right, most):
    """Space for at most `most` iterations on the right-hand side (size,), not zero.

    Returns basis (most + 1, size), whose first row is set, the triangle that the Hessenberg matrix
    is turned into (most + 1, most), its rotations (most, 2) and the turned right-hand side.
    """
    # Not zeroed: most iterations never come, and clearing their memory costs more than a scene.
    basis = np.empty((most + 1, len(right)))
    triangle = np.empty((most + 1, most))
    rotations = np.empty((most, 2))
    target = np.empty(most + 1)
    norm = np.sqrt(_product(right, right))
    basis[0] = right / norm
    target[0] = norm
    return basis, triangle, rotations, target


@njit(cache=True)
def extended(krylov, k):
    """Take up basis[k + 1], the operator's image of basis[k]; the norm of the residual."""
    basis, triangle, rotations, target = krylov
    new = basis[k + 1]
    for i in range(k + 1):
        h = _product(basis[i], new)
        triangle[i, k] = h
        new -= h * basis[i]
    length = np.sqrt(_product(new, new))
    if length > 0.0:
        new /= length
    for i in range(k):
        c, s = rotations[i]
        h, below = triangle[i, k], triangle[i + 1, k]
        triangle[i, k], triangle[i + 1, k] = c * h + s * below, c * below - s * h
    h = triangle[k, k]
    radius = np.sqrt(h * h + length * length)
    c, s = h / radius, length / radius
    rotations[k, 0], rotations[k, 1] = c, s
    triangle[k, k] = radius
    target[k + 1] = -s * target[k]
    target[k] *= c
    return abs(target[k + 1])


@njit(cache=True)
def combined(krylov, iterations):
    """The vector (size,) of the first `iterations` basis vectors whose residual is smallest."""
    basis, triangle, _, target = krylov
    weights = np.empty(iterations)
    for i in range(iterations - 1, -1, -1):
        value = target[i]
        for j in range(i + 1, iterations):
            value -= triangle[i, j] * weights[j]
        weights[i] = value / triangle[i, i]
    solution = np.zeros(basis.shape[1])
    for i in range(iterations):
        solution += weights[i] * basis[i]
    return solution
