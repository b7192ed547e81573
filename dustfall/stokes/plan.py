"""How many degrees of surface harmonics each pair of spheres exchanges, and what is left out."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from dustfall.spheres import centre_distances, checked_centres, checked_tolerance
from dustfall.stokes.translation import MOST_DEGREE

SMALLEST_TOLERANCE, LARGEST_TOLERANCE = 1e-8, 0.1


@dataclass(frozen=True)
class Plan:
    """How many degrees of harmonics each pair of a scene exchanges.

    centres: (n, 3) [d_p]. degrees: (n, n), symmetric, zero on the diagonal. error: (n,) estimate of
    the error of each sphere's force, over an isolated sphere's, from the degrees left out.
    """

    centres: np.ndarray
    degrees: np.ndarray
    error: np.ndarray


def plan_scene(centres, tolerance: float = 1e-4) -> Plan:
    """Choose the degrees that every pair exchanges.

    centres: (n, 3) [d_p]. tolerance: of the force, relative to an isolated sphere's.
    Raises ValueError for a wrong shape, values that are not finite, overlaps, or a tolerance
    outside [1e-8, 0.1].
    """
    centres = checked_centres(centres)
    tolerance = checked_tolerance(tolerance, SMALLEST_TOLERANCE, LARGEST_TOLERANCE)
    return Plan(centres, *_choose_degrees(centre_distances(centres), tolerance, MOST_DEGREE))


@njit(cache=True)
def truncation_error(degree, excited, felt):
    """Relative error of a force that comes of leaving out harmonics above `degree`.

    A sphere j is excited by a sphere k and felt by a sphere i (which may be k); excited, felt: xi
    of both pairs, cosh(xi) = distance / d_p. Each way costs a harmonic of degree l a factor
    exp(-xi l) (for two spheres, Stimson and Jeffery 1926), so the error is geometric in the degree
    where spheres are apart; where they nearly touch it falls with the cube of the degree. Constants
    are fitted to pairs, triangles, chains, tetrahedra and six spheres with gaps from 0.001 to 3
    d_p, degrees from 0 to 32, and to random scenes.
    """
    terms = degree + 1.0
    rate, both = excited + felt, 2.0 * np.sqrt(excited * felt)
    apart = np.exp(np.minimum(rate * (terms + 1.0), 300.0)) / (4.0 * terms)
    near = 2.0 * terms**3 * np.exp(0.54 * np.minimum(both * terms, 300.0))
    return 1.0 / (apart + near)


@njit(cache=True)
def _left_out(xi, degrees):
    """Error of each sphere's force by the degrees that no chain i - j - k carries, (n,)."""
    n = len(xi)
    out = np.zeros(n)
    for i in range(n):
        for j in range(n):
            for k in range(n):
                if j != i and j != k:
                    degree = min(degrees[i, j], degrees[j, k])
                    out[i] += truncation_error(degree, xi[j, k], xi[i, j]) ** 2
    return np.sqrt(out)


@njit(cache=True)
def _choose_degrees(distance, tolerance, most):
    """Degrees (n, n) and error (n,) of a scene; share by share smaller until the error fits."""
    n = len(distance)
    xi = np.arccosh(distance)
    degrees = np.zeros((n, n), dtype=np.int64)
    error = np.zeros(n)
    if n == 1:
        return degrees, error
    share = tolerance
    while True:
        complete = True
        for i in range(n):
            for j in range(i):
                # What excites the two: each other, or a third sphere that is closer to either.
                excited = min(np.min(xi[i]), np.min(xi[j]))
                degree = degrees[i, j]
                while degree < most and truncation_error(degree, excited, xi[i, j]) > share:
                    degree += 1
                degrees[i, j] = degrees[j, i] = degree
                complete &= degree == most
        own = _left_out(xi, degrees)
        # A wrong force on a neighbour is felt as its Stokeslet: at most 3/2 radius over distance.
        error = own + (0.75 / distance) @ own
        if np.max(error) <= 0.8 * tolerance or complete or share < 1e-6 * tolerance:
            return degrees, error
        share *= 0.5
