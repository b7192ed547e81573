"""How many degrees of surface harmonics each pair of spheres exchanges, and what is left out."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from dustfall.spheres import checked_distances, checked_positions, checked_tolerance
from dustfall.stokes.memory import check_memory
from dustfall.stokes.translation import MOST_DEGREE

SMALLEST_TOLERANCE, LARGEST_TOLERANCE = 1e-8, 0.1

PLAN_BYTES = 80
"""For each of n^2 pairs: distances, slopes, degrees, and what a plan works with."""

UNASKED = 1000
"""Spheres whose plan any machine has the memory for: to ask would take a part of their solve."""

NEGLIGIBLE = 1e-16
"""Fields below this are left out of the bound: a million of them are 1e-2 of the smallest
tolerance."""


@dataclass(frozen=True)
class Plan:
    """How many degrees of harmonics each pair of a scene exchanges.

    centres: (n, 3), distance: (n, n), of the centres, inf on the diagonal [d_p]. degrees: (n, n),
    symmetric, zero on the diagonal.
    """

    centres: np.ndarray
    distance: np.ndarray
    degrees: np.ndarray


def plan_scene(centres, tolerance: float = 1e-4) -> Plan:
    """Choose the degrees that every pair exchanges.

    centres: (n, 3) [d_p]. tolerance: of the force, relative to an isolated sphere's.
    Raises ValueError for a wrong shape, values that are not finite, overlaps, or a tolerance
    outside [1e-8, 0.1], and MemoryError before more memory is taken than there is.
    """
    centres = checked_positions(centres)
    if len(centres) > UNASKED:
        check_memory(len(centres), PLAN_BYTES * len(centres) ** 2)
    distance = checked_distances(centres)
    tolerance = checked_tolerance(tolerance, SMALLEST_TOLERANCE, LARGEST_TOLERANCE)
    return Plan(centres, distance, _choose_degrees(distance, tolerance, MOST_DEGREE))


# What a pair leaves out, and what a sphere next to another makes of it. Degrees n of a field on a
# sphere fade as exp(-n xi) with the distance of the sphere that makes it, cosh(xi) = distance / d_p
# (the poles of bispherical coordinates); near contact they fall by a power of n instead. Velocities
# are over that of the flow, forces over that on an isolated sphere. The numbers bound what
# `benchmarks.truncation` samples.


@njit(cache=True)
def missing_velocity(degree, xi):
    """Velocity that the traction of a sphere makes on another beyond `degree`, at most."""
    terms = degree + 1.0
    apart = np.exp(min(xi * (terms + 1.0), 600.0))
    near = terms**4 * np.exp(min(0.2 * xi * terms, 600.0))
    return 1.1 / (apart + near)


@njit(cache=True)
def pushed(terms, xi, gap):
    """Force on a sphere by a velocity of degree `terms` coming in on another, fixed one, at most.

    Near contact the velocity is that of an approach in part, and lubrication makes the force of an
    approach grow as 1 / gap (Jeffrey and Onishi 1984: X11A).
    """
    return _push(xi, gap) * (1.0 + terms * min(xi, 2.6)) * np.exp(-min(terms * xi, 600.0))


@njit(cache=True)
def _push(xi, gap):
    return (0.225 + 0.275 * min(0.5 * xi, 1.0)) / gap


@njit(cache=True)
def echo(distance):
    """Force by a velocity on the sphere itself, which the other sends back, over `pushed`."""
    return min(1.25 / distance, 1.0)


@njit(cache=True)
def held(terms):
    """Part of a traction at degree `terms` on a sphere of a fixed pair in a smooth flow, at most.

    However near they are: what flows by a fixed pair does not squeeze it.
    """
    return 2.0 / (terms + 1.0) ** 2


@njit(cache=True)
def uniform_error(degree, xi):
    """Error of the force on two fixed spheres alone in a uniform flow, all degrees beyond left out.

    Far apart 4 / s^4, s in radii, at degree 0 (the next reflection; Happel and Brenner 1983).
    """
    terms = degree + 1.0
    apart = np.exp(min(2.0 * xi * (terms + 1.0), 600.0)) / (4.0 * terms)
    near = terms**6 / 2.6 * np.exp(min(0.5 * xi * terms, 600.0))
    return 1.0 / (apart + near)


@njit(cache=True)
def strained_error(degree, xi):
    """As `uniform_error`, in a flow whose velocity changes by 1 over a radius."""
    terms = degree + 1.0
    apart = np.exp(min(2.0 * xi * (terms + 1.0), 600.0)) * np.sqrt(terms) / 24.0
    near = terms**5 / 10.0 * np.exp(min(0.55 * xi * terms, 600.0))
    return 1.0 / (apart + near)


@njit(cache=True)
def strain(distance):
    """Change over a radius, at most, of the velocity that a sphere makes at a distance [d_p]."""
    return 1.5 / (2.0 * distance - 1.0) ** 2


@njit(cache=True)
def _sums(distance, xi, sources, highest):
    """What spheres answer together: sums over all others j of a sphere i.

    sources: (n, n), strength of j as i sees it, at most 1. Returns three arrays (n, highest + 2),
    column t: `pushed` at degree t, its echoes, and the traction of degree t that the sources leave;
    and the strain (n,) of the sources' flow.
    """
    n = len(xi)
    shape = (n, highest + 2)
    pushes, echoes, tractions = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    strains = np.zeros(n)
    for i in range(n):
        for j in range(n):
            if j != i:
                d, slope = distance[i, j], min(xi[i, j], 2.6)
                fade, power, back = np.exp(-xi[i, j]), _push(xi[i, j], d - 1.0), echo(d)
                for t in range(1, highest + 2):
                    power *= fade
                    if power < NEGLIGIBLE:
                        break
                    push = power * (1.0 + t * slope)
                    pushes[i, t] += push
                    echoes[i, t] += back * push
                    tractions[i, t] += sources[i, j] * min(push, held(t))
                strains[i] += sources[i, j] * strain(d)
    return pushes, echoes, tractions, strains


@njit(cache=True)
def _of_pair(i, j):
    """Where pair i, j is in an array of all pairs."""
    return i * (i - 1) // 2 + j if i > j else j * (j - 1) // 2 + i


@njit(cache=True)
def _put_pair(degree, xi, gap, pair):
    """Write what `_left_out` wants of a pair: pair (4,)."""
    pair[0], pair[1] = missing_velocity(degree, xi), pushed(degree + 1, xi, gap)
    pair[2], pair[3] = uniform_error(degree, xi), strained_error(degree, xi)


@njit(cache=True)
def _left_out(distance, xi, sources, sums, degrees, pairs):
    """Error (n,) of each sphere's own force by the degrees that pairs do not exchange.

    pairs: (n (n - 1) / 2, 4), of each pair at its degree t - 1 `missing_velocity`, `pushed` at t,
    `uniform_error` and `strained_error`.
    Degree t is the first that j's field lacks on i. It would push whatever is next to i, and i
    itself by its echo; and j's own traction of that degree, which all others make, does not reach
    i. All are added, as they may add.
    """
    _, echoes, tractions, strains = sums
    n, columns = echoes.shape
    out, missing, highest = np.zeros(n), np.zeros((n, columns)), 1
    for i in range(n):
        for j in range(n):
            if j != i:
                t, d = degrees[i, j] + 1, distance[i, j]
                highest = max(highest, t)
                velocity, push, uniform, strained = pairs[_of_pair(i, j)]
                source = sources[i, j]
                missing[i, t] += source * velocity
                around = max(max(strains[i], strains[j]) - source * strain(d), 0.0)
                out[i] += sources[j, i] * uniform
                out[i] += around * strained
                out[i] += source * velocity * max(echoes[i, t] - echo(d) * push, 0.0)
                traction = tractions[j, t] - sources[j, i] * min(push, held(t))
                out[i] += velocity * max(traction, 0.0)
                # Taken back below, where i itself is the source that pushes it.
                out[i] -= sources[j, i] * velocity * push
    for i in range(n):
        for j in range(n):
            if j != i:
                slope = min(xi[i, j], 2.6)
                fade, power = np.exp(-xi[i, j]), _push(xi[i, j], distance[i, j] - 1.0)
                for t in range(1, highest + 1):
                    power *= fade
                    if power < NEGLIGIBLE:
                        break
                    out[i] += missing[j, t] * power * (1.0 + t * slope)
    return np.maximum(out, 0.0)


@njit(cache=True)
def _felt_by_others(distance, own, screen):
    """Error (n,) of all forces: a wrong one is felt by others as its Stokeslet, 3/4 d_p / distance.

    screen: (n,), how much of a flow a sphere takes up where others shelter it.
    """
    error = own.copy()
    for i in range(len(own)):
        for j in range(len(own)):
            if j != i:
                error[i] += 0.75 / distance[i, j] * screen[j] * own[j]
    return error


@njit(cache=True)
def _sources(centres, distance, force):
    """Strength (n, n) of j as i sees it: of its Stokeslet (n, 3), along the line more than across.

    The bound is met along the line of centres. Across it the field is weaker, far away by 0.42.
    """
    n = len(centres)
    out = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            if j != i:
                d = distance[i, j]
                along = square = 0.0
                for k in range(3):
                    along += force[j, k] * (centres[i, k] - centres[j, k]) / d
                    square += force[j, k] ** 2
                weaker = min(0.45 + 0.75 / d, 1.0)
                out[i, j] = np.sqrt(along**2 + weaker**2 * max(square - along**2, 0.0))
    return out


@njit(cache=True)
def error_bound(centres, distance, degrees, force):
    """Error (n,) of the forces on spheres by the degrees left out, over an isolated sphere's.

    centres: (n, 3), distance: (n, n) [d_p], degrees: (n, n), force: (n, 3), as they were found,
    over that on an isolated sphere.
    """
    xi = np.arccosh(distance)
    sources = _sources(centres, distance, force)
    sums = _sums(distance, xi, sources, np.max(degrees))
    n = len(distance)
    pairs = np.empty((n * (n - 1) // 2, 4))
    for i in range(n):
        for j in range(i):
            _put_pair(degrees[i, j], xi[i, j], distance[i, j] - 1.0, pairs[_of_pair(i, j)])
    own = _left_out(distance, xi, sources, sums, degrees, pairs)
    screen = np.empty(n)
    for i in range(n):
        screen[i] = min(1.5 * np.sqrt(np.sum(force[i] ** 2)), 1.0)
    return _felt_by_others(distance, own, screen)


@njit(cache=True)
def _choose_degrees(distance, tolerance, most):
    """Degrees (n, n) of a scene; share by share smaller until the error fits."""
    n = len(distance)
    degrees = np.zeros((n, n), dtype=np.int64)
    if n == 1:
        return degrees
    xi = np.arccosh(distance)
    sources = np.ones((n, n))
    sums = _sums(distance, xi, sources, most)
    pushes, _, tractions, strains = sums
    screen = np.zeros(n)
    for i in range(n):
        for j in range(n):
            if j != i:
                screen[i] += 0.5 / distance[i, j]
    screen = 1.0 / (1.0 + screen)
    # What a pair leaves out changes with its degree alone, and few change from share to share.
    pairs = np.empty((n * (n - 1) // 2, 4))
    share, left = tolerance, np.full((n, n), np.inf)
    while True:
        complete = True
        for i in range(n):
            for j in range(i):
                # The next degree while what this pair alone leaves out exceeds its share.
                while left[i, j] > share and degrees[i, j] < most:
                    degree = degrees[i, j] + (0 if left[i, j] == np.inf else 1)
                    t = degree + 1
                    pair = pairs[_of_pair(i, j)]
                    _put_pair(degree, xi[i, j], distance[i, j] - 1.0, pair)
                    velocity, own, uniform, strained = pair
                    others = max(pushes[i, t], pushes[j, t]) - own
                    others += max(tractions[i, t], tractions[j, t]) - min(own, held(t))
                    around = max(max(strains[i], strains[j]) - strain(distance[i, j]), 0.0)
                    left[i, j] = velocity * max(others, 0.0) + uniform + around * strained
                    degrees[i, j] = degrees[j, i] = degree
                complete &= degrees[i, j] == most
        own = _left_out(distance, xi, sources, sums, degrees, pairs)
        error = np.max(_felt_by_others(distance, own, screen))
        if error <= 0.9 * tolerance or complete or share < 1e-6 * tolerance:
            return degrees
        share *= 0.5
