"""Degrees of harmonics that spheres of any radii exchange when they move, and what they leave out.

A rule of thumb, not a bound: it balances the pairs against each other. How wrong a solution is
follows from two of them (`stokes.moving`).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

CLOSE = 0.62
"""Slope xi below which the high degrees of a pair are eliminated: a gap of 0.2 d_p."""

LONE_DIGITS = 6.0
"""Degrees of a close pair, over its slope, beyond those that e^-(2 degree xi) asks for.

Lubrication makes the error of a force larger than that by up to e^12 at a gap of 1e-4 d_p.
"""

MOST_ELIMINATED = 20_000
"""Largest degree of a close pair: gaps down to about 1e-6 d_p."""


@dataclass(frozen=True)
class MovingPlan:
    """How many degrees each pair of a scene exchanges.

    degrees: (n, n), symmetric, zero on the diagonal. close: (n, n), whether a pair's degrees beyond
    are eliminated. eliminated: (n, n), up to which, on sphere i of the pair i, j. left_out: (n,)
    what each sphere lacks by the rule. unresolved: (n,), what it lacks where MOST_ELIMINATED ends
    the degrees of a close pair, over its own load, which lubrication makes large.
    """

    degrees: np.ndarray
    close: np.ndarray
    eliminated: np.ndarray
    left_out: np.ndarray
    unresolved: np.ndarray


def plan_moving(
    distance, radii, tolerance: float, amplified: bool, least: int, most: int
) -> MovingPlan:
    """Choose the degrees that every pair exchanges.

    distance: (n, n), inf on the diagonal; radii: (n,), in one unit. tolerance: of what the degrees
    left out do to a sphere, relative to its own motion. amplified: whether velocities are given, so
    that lubrication makes large forces of small errors. least, most: degree of a close pair, and of
    any, for others.
    """
    xi = slopes(distance, radii)
    degrees, close, left_out = _choose(distance, xi, radii, tolerance, amplified, least, most)
    digits = 0.5 * np.log(1.0 / tolerance) + LONE_DIGITS
    wanted = np.ceil(digits / np.maximum(xi, digits / MOST_ELIMINATED))
    eliminated = np.where(close, np.maximum(wanted, degrees + 1), 0).astype(int)
    alone = np.exp(2.0 * np.minimum(LONE_DIGITS - eliminated * np.where(close, xi, 0.0), 0.0))
    alone = np.where(close, np.maximum(alone, alone.T), 0.0)
    left_out = np.sqrt(left_out**2 + np.sum(alone**2, axis=1))
    ended = np.where(eliminated >= MOST_ELIMINATED, alone, 0.0)
    unresolved = np.sqrt(np.sum(np.maximum(ended, ended.T) ** 2, axis=1))
    return MovingPlan(degrees, close, eliminated, left_out, unresolved)


def slopes(distance, radii) -> np.ndarray:
    """Slope xi (n, n): fields of sphere j on sphere i fade as exp(-xi degree); inf for i = j.

    cosh(xi) = (d^2 + a_i^2 - a_j^2) / (2 d a_i): bispherical coordinates about both.
    """
    a, b = radii[:, None], radii[None, :]
    with np.errstate(invalid="ignore"):
        above_one = (distance - a - b) / (2.0 * a) * ((distance - a + b) / distance)
    np.fill_diagonal(above_one, np.inf)
    return 2.0 * np.arcsinh(np.sqrt(0.5 * above_one))


def most_amplified(distance, radii) -> float:
    """Largest force over Stokes drag, about, that a sphere feels that approaches another."""
    a, b = radii[:, None], radii[None, :]
    return float(1.0 + np.max(a * (b / (a + b)) ** 2 / (distance - a - b)))


@njit(cache=True)
def _choose(distance, xi, radii, tolerance, amplified, least, most):
    """Degrees (n, n), closeness (n, n), and the root of the squares (n,) of what is left out.

    The share of a pair is halved until what is left out on any sphere is within the tolerance. Not
    counted is what pairs leave out that have `most` degrees: others could not make up for it.
    """
    n = len(radii)
    degrees = np.zeros((n, n), dtype=np.int64)
    close = np.zeros((n, n), dtype=np.bool_)
    left, avoidable = np.zeros(n), np.zeros(n)
    if n == 1:
        return degrees, close, left
    first, second, which = _felt(distance, xi, radii, amplified, most)
    for i in range(n):
        for j in range(i):
            close[i, j] = close[j, i] = min(xi[i, j], xi[j, i]) < CLOSE
    share = tolerance
    while True:
        left[:] = avoidable[:] = 0.0
        for i in range(n):
            for j in range(i):
                degree = least if close[i, j] else 0
                degree = min(max(degree, degrees[i, j]), most)
                while True:
                    at_i, at_j = _left_out(
                        i, j, degree, distance, xi, radii, close, first, second, which
                    )
                    if at_i + at_j <= share or degree == most:
                        break
                    degree += 1
                degrees[i, j] = degrees[j, i] = degree
                square = (at_i + at_j) ** 2
                left[i] += square
                left[j] += square
                if degree < most:
                    avoidable[i] += square
                    avoidable[j] += square
        if np.max(avoidable) <= tolerance**2:
            break
        share *= 0.5
    _level_close(degrees, close)
    return degrees, close, np.sqrt(left)


@njit(cache=True)
def _felt(distance, xi, radii, amplified, most):
    """How strongly a velocity of degree t coming in on a sphere is felt, by way of its neighbours.

    Returns the largest and the second largest over all neighbours, (n, most + 2), and the neighbour
    of the largest.
    """
    n = len(radii)
    first, second = np.zeros((n, most + 2)), np.zeros((n, most + 2))
    which = np.full((n, most + 2), -1)
    for i in range(n):
        for j in range(n):
            if j == i:
                continue
            gap = distance[i, j] - radii[i] - radii[j]
            # Lubrication against approach (Jeffrey and Onishi 1984): X11A = reduced radius^2 / gap.
            push = 1.0
            if amplified:
                push += radii[i] * (radii[j] / (radii[i] + radii[j])) ** 2 / gap
            for t in range(1, most + 2):
                value = push * (1.0 + t * min(xi[i, j], 2.6)) * np.exp(-min(t * xi[i, j], 600.0))
                if value > first[i, t]:
                    second[i, t] = first[i, t]
                    first[i, t], which[i, t] = value, j
                elif value > second[i, t]:
                    second[i, t] = value
    return first, second, which


@njit(cache=True)
def _left_out(i, j, degree, distance, xi, radii, close, first, second, which):
    """Error at i, and at j, of what the pair does not exchange beyond a degree."""
    t = degree + 1
    out = np.zeros(2)
    for place, (here, there) in enumerate(((i, j), (j, i))):
        velocity = radii[there] / distance[here, there] * np.exp(-min(t * xi[here, there], 600.0))
        felt = first[here, t]
        if close[here, there] and which[here, t] == there:
            felt = second[here, t]
        # The first degree is torque and stresslet themselves.
        out[place] = velocity * (max(felt, 1.0) if t == 1 else felt)
    return out[0], out[1]


@njit(cache=True)
def _level_close(degrees, close):
    """Raise the degree of close pairs to all that either sphere has, in place.

    What is eliminated may not come in from a third sphere.
    """
    n = len(degrees)
    changed = True
    while changed:
        changed = False
        for i in range(n):
            for j in range(i):
                if close[i, j]:
                    high = max(np.max(degrees[i]), np.max(degrees[j]))
                    if high > degrees[i, j]:
                        degrees[i, j] = degrees[j, i] = high
                        changed = True
