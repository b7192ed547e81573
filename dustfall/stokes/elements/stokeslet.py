"""The fundamental solution of Stokes flow, G = I/r + r r^T / r^3, and where its entries stand."""

import numpy as np
from numba import njit


@njit(cache=True, inline="always")
def stokeslet(dx, dy, dz, out):
    """Six independent entries xx, xy, xz, yy, yz, zz of I/r + r r^T / r^3."""
    r2 = dx * dx + dy * dy + dz * dz
    inverse = 1.0 / np.sqrt(r2)
    cube = inverse / r2
    out[0] = inverse + dx * dx * cube
    out[1] = dx * dy * cube
    out[2] = dx * dz * cube
    out[3] = inverse + dy * dy * cube
    out[4] = dy * dz * cube
    out[5] = inverse + dz * dz * cube


@njit(cache=True, inline="always")
def put_block(matrix, a, b, entries):
    """Write the six independent entries as the symmetric 3 x 3 block (a, b) of a matrix."""
    matrix[3 * a, 3 * b] = entries[0]
    matrix[3 * a + 1, 3 * b + 1] = entries[3]
    matrix[3 * a + 2, 3 * b + 2] = entries[5]
    matrix[3 * a, 3 * b + 1] = matrix[3 * a + 1, 3 * b] = entries[1]
    matrix[3 * a, 3 * b + 2] = matrix[3 * a + 2, 3 * b] = entries[2]
    matrix[3 * a + 1, 3 * b + 2] = matrix[3 * a + 2, 3 * b + 1] = entries[4]
