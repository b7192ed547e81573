"""Kaiser-Bessel window: takes point forces to a grid, and velocities from the grid to points.

In units of the grid's spacing the window of P points is I0(s sqrt(1 - (2 z / P)^2)) / I0(s) for
|z| < P / 2, in each of the three directions (Potts & Steidl 2003, SIAM J. Sci. Comput. 24, 2013).
"""

from functools import lru_cache

import numpy as np
from numba import njit

EXTRA_TERMS = 3
"""Of the polynomials that stand for the window between grid points, beyond its number of points:
their error is then a tenth of the window's own."""


def window_steepness(points: int, oversampling: float) -> float:
    """s, with the first zero of the window's transform where the nearest alias comes in."""
    return np.pi * points * (1 - 0.5 / oversampling)


def window(z, points: int, steepness: float) -> np.ndarray:
    """The window at distance z from the particle, in grid spacings."""
    inside = np.maximum(1 - (2 * np.asarray(z) / points) ** 2, 0.0)
    return np.i0(steepness * np.sqrt(inside)) / np.i0(steepness)


def window_transform(angle, points: int, steepness: float) -> np.ndarray:
    """Fourier transform of the window; angle: wavenumber times the grid's spacing."""
    square = steepness**2 - (points * np.asarray(angle) / 2) ** 2
    root = np.sqrt(np.abs(square))
    # sinh(x) / x, which is sinc of an imaginary number.
    value = np.where(square > 0, np.sinh(root) / np.maximum(root, 1e-300), np.sinc(root / np.pi))
    return points * value / np.i0(steepness)


@lru_cache
def window_polynomials(points: int, steepness: float) -> np.ndarray:
    """Coefficients (terms, points), highest power first, of the window at its grid points.

    As polynomials in t, which goes from -1 to 1 while a particle moves by one grid spacing, by
    interpolation at Chebyshev points.
    """
    terms = points + EXTRA_TERMS
    t = np.polynomial.chebyshev.chebpts1(terms)
    z = np.arange(points)[:, None] - points / 2 + (t + 1) / 2
    fit = np.polynomial.chebyshev.chebfit(t, window(z, points, steepness).T, terms - 1)
    coefficients = np.zeros((terms, points))
    for p, column in enumerate(fit.T):
        powers = np.polynomial.chebyshev.cheb2poly(column)
        coefficients[: len(powers), p] = powers
    return np.ascontiguousarray(coefficients[::-1])


@lru_cache
def window_kernels(points: int):
    """Compile `weigh`, `spread` and `interpolate` for windows of so many points.

    The number is a constant of the compiled code: its loops are then unrolled and vectorised.
    """
    width = 3 * points

    @njit(cache=True, nogil=True, fastmath=True)
    def weigh(first, last, point, grid, spacing, polynomials, base, weight):
        """First grid point (n, 3) and weights (n, 3, points) of particles `first` to `last - 1`."""
        value = np.empty(points)
        for i in range(first, last):
            for axis in range(3):
                place = point[i, axis] / spacing - points / 2
                lowest = np.floor(place) + 1
                t = 2 * (lowest - place) - 1
                value[:] = polynomials[0]
                for k in range(1, len(polynomials)):
                    for p in range(points):
                        value[p] = value[p] * t + polynomials[k, p]
                for p in range(points):
                    weight[i, axis, p] = value[p]
                base[i, axis] = int(lowest) % grid

    @njit(cache=True, nogil=True, fastmath=True)
    def spread(first, last, base, weight, force, field):
        """Add the forces of particles `first` to `last - 1` to the field (M, M, 3 (M + points)).

        The last axis holds three components a point, and room for windows that reach over the end.
        """
        grid = len(field)
        line = np.empty(width, field.dtype)
        for i in range(first, last):
            for p in range(points):
                for axis in range(3):
                    line[3 * p + axis] = weight[i, 2, p] * force[i, axis]
            start = 3 * base[i, 2]
            for p in range(points):
                x = base[i, 0] + p
                x -= grid if x >= grid else 0
                for q in range(points):
                    y = base[i, 1] + q
                    y -= grid if y >= grid else 0
                    share = weight[i, 0, p] * weight[i, 1, q]
                    row = field[x, y, start : start + width]
                    for k in range(width):
                        row[k] += share * line[k]

    @njit(cache=True, nogil=True, fastmath=True)
    def interpolate(first, last, base, weight, field, velocity):
        """Set the velocities of particles `first` to `last - 1` to those of the field."""
        grid = len(field)
        line = np.empty(width, field.dtype)
        for i in range(first, last):
            line[:] = 0
            start = 3 * base[i, 2]
            for p in range(points):
                x = base[i, 0] + p
                x -= grid if x >= grid else 0
                for q in range(points):
                    y = base[i, 1] + q
                    y -= grid if y >= grid else 0
                    share = weight[i, 0, p] * weight[i, 1, q]
                    row = field[x, y, start : start + width]
                    for k in range(width):
                        line[k] += share * row[k]
            for axis in range(3):
                velocity[i, axis] = 0
                for p in range(points):
                    velocity[i, axis] += weight[i, 2, p] * line[3 * p + axis]

    return weigh, spread, interpolate


@njit(cache=True, nogil=True)
def fold(field):
    """Add what lies over the end of the field's last axis to its beginning."""
    grid = len(field)
    for x in range(grid):
        for y in range(grid):
            for k in range(3 * grid, field.shape[2]):
                field[x, y, k - 3 * grid] += field[x, y, k]


@njit(cache=True, nogil=True)
def unfold(field):
    """Repeat the beginning of the field's last axis over its end."""
    grid = len(field)
    for x in range(grid):
        for y in range(grid):
            for k in range(3 * grid, field.shape[2]):
                field[x, y, k] = field[x, y, k - 3 * grid]
