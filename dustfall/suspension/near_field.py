"""What the Rotne-Prager tensor lacks where two spheres are close: resistance to relative motion.

Added to the resistance in the relative motion of a pair only. A pair that moves as one has no
lubrication, and the textbook correction, which changes its drag too, counts the flow of third
spheres twice.
"""

import math
from functools import lru_cache

import numpy as np
import scipy
from numba import njit

from dustfall.suspension.conjugate_gradients import conjugate_gradients
from dustfall.suspension.cube import folded
from dustfall.suspension.rotne_prager import pair_coefficients
from dustfall.units import CONTACT

REACH = 2.5
"""Centre distance [d_p] up to which pairs are corrected; 0.012 of Stokes drag are left there."""

SMALLEST_GAP = 1e-3
"""Gap [d_p] below which the resistance grows no more: spheres are not smoother than that."""

GAPS = 400
"""Of the table, in geometric progression: linear interpolation is then off by 4e-5."""

RESIDUAL = 1e-8
"""Of relaxed velocities, relative: far below the tolerances of forces."""

ACROSS = {
    0.001: 2.1101, 0.0025: 2.0684, 0.005: 2.0267, 0.01: 1.97477, 0.02: 1.90991, 0.035: 1.84528,
    0.05: 1.79730, 0.075: 1.73573, 0.1: 1.68743, 0.15: 1.61326, 0.2: 1.55701, 0.25: 1.51192,
    0.375: 1.42868, 0.5: 1.37048, 0.75: 1.29301, 1.0: 1.24316, 1.5: 1.18213,
}  # fmt: skip
"""Force over isolated Stokes drag at a gap [d_p], on spheres that pass each other across their
line of centres in opposite directions and turn freely (1 / (y11a - y12a) of Kim & Karrila 1991):
multipole expansions of 40 degrees, converged to the last digit from a gap of 0.005 on."""


def approach_resistance(gap: float) -> float:
    """Force over isolated Stokes drag on two spheres that approach each other head on.

    gap: between the surfaces [d_p], positive. Series in bispherical coordinates of a sphere that
    approaches a plane free of tangential stress, which the plane midway is (Brenner 1961, Chem.
    Eng. Sci. 16, 242, Eq. 3.13).
    """
    alpha = math.acosh(1.0 + gap)
    total, n, term = 0.0, 0, 1.0
    while abs(term) > 1e-12 * abs(total) or n < 2:
        n += 1
        k = 2 * n + 1
        # Hyperbolic functions over exp(k alpha) / 2.
        decay = math.exp(-k * alpha)
        above = 2 * (1 + decay) ** 2 + 2 * k**2 * math.sinh(alpha) ** 2 * decay
        below = 2 * (1 - decay**2) - 2 * k * math.sinh(2 * alpha) * decay
        term = n * (n + 1) / ((2 * n - 1) * (2 * n + 3)) * (above / below - 1)
        total += term
    return 4 / 3 * math.sinh(alpha) * total


@lru_cache(maxsize=1)
def relative_resistance() -> tuple[np.ndarray, np.ndarray]:
    """Table of gaps (m,) [d_p], and what Rotne-Prager's resistance lacks there (m, 2).

    Along and across the line of centres, over isolated Stokes drag, for opposite velocities.
    """
    gap = np.geomspace(SMALLEST_GAP, REACH - CONTACT, GAPS)
    unit, dyad = np.array([pair_coefficients(CONTACT + g) for g in gap]).T
    along = [approach_resistance(g) for g in gap] - 1 / (1 - unit - dyad)
    lacking = [f - 1 / (1 - pair_coefficients(CONTACT + g)[0]) for g, f in ACROSS.items()]
    across = scipy.interpolate.PchipInterpolator(np.log(list(ACROSS)), lacking)(np.log(gap))
    return gap, np.stack([along, across], axis=1)


class NearField:
    """Resistance to the relative motion of close pairs, beyond Rotne-Prager's.

    Parameters
    ----------
    position : (n, 3) in d_p, wrapped or not
    side : of the cube, d_p; more than twice `REACH`
    way : (n, 3) that each particle would go in the time in which pairs may not touch
    stiff : resistance of a pair that would, along its line of centres

    Attributes
    ----------
    stopped : pairs that would touch on their way
    overlapping : pairs of which the centres are closer than a diameter

    Raises
    ------
    ValueError : the cube is too small.
    """

    def __init__(self, position: np.ndarray, side: float, way: np.ndarray, stiff: float):
        if side <= 2 * REACH:
            raise ValueError(f"side of the cube is {side}: more than {2 * REACH} d_p is needed")
        tree = scipy.spatial.cKDTree(folded(position, side), boxsize=side)
        # As far as two particles can see each other come, and less than half the side.
        fastest = 2 * np.linalg.norm(way - way.mean(axis=0), axis=1).max()
        reach = min(max(REACH, CONTACT + fastest), side / 2)
        pair = tree.query_pairs(reach, output_type="ndarray")
        pair = pair[np.lexsort((pair[:, 1], pair[:, 0]))]
        separation = position[pair[:, 0]] - position[pair[:, 1]]
        separation -= side * np.rint(separation / side)
        distance = np.linalg.norm(separation, axis=1)
        relative_way = way[pair[:, 0]] - way[pair[:, 1]]
        stops = _would_touch(separation, relative_way)
        kept = stops | (distance < REACH)
        self.stopped = int(stops.sum())
        self.overlapping = int((distance < CONTACT).sum())
        # Of the particles that have a close one, by their own numbers.
        self._particles, number = np.unique(pair[kept], return_inverse=True)
        self._pair = number.reshape(-1, 2)
        self._direction = separation[kept] / distance[kept, None]
        gap, table = relative_resistance()
        at = np.log(np.maximum(distance[kept] - CONTACT, SMALLEST_GAP))
        self._along, self._across = (np.interp(at, np.log(gap), column) for column in table.T)
        far = distance[kept] >= REACH
        self._along[far] = self._across[far] = 0.0
        self._along[stops[kept]] = stiff

    def forces(self, velocity: np.ndarray) -> np.ndarray:
        """Forces (n, 3) by which the fluid resists velocities (n, 3), over Stokes drag."""
        force = np.zeros_like(velocity)
        force[self._particles] = self._resist(velocity[self._particles])
        return force

    def relaxed(self, velocity: np.ndarray, time: float) -> np.ndarray:
        """Velocities (n, 3) after close pairs have resisted for a time [tau], by implicit Euler."""
        after = velocity.copy()
        close = velocity[self._particles]
        after[self._particles], _ = conjugate_gradients(
            lambda v: v + time * self._resist(v), close, close, RESIDUAL
        )
        return after

    def _resist(self, velocity):
        force = np.zeros_like(velocity)
        _resist(self._pair, self._direction, self._along, self._across, velocity, force)
        return force


def _would_touch(separation, relative_way):
    """Whether pairs that go straight on come closer than a diameter, and closer than they are."""
    square = (relative_way**2).sum(axis=1)
    approach = -(separation * relative_way).sum(axis=1)
    part = np.divide(approach, square, out=np.zeros_like(square), where=square > 0)
    closest = separation + np.clip(part, 0, 1)[:, None] * relative_way
    return (approach > 0) & ((closest**2).sum(axis=1) < CONTACT**2)


@njit(cache=True, nogil=True)
def _resist(pair, direction, along, across, velocity, force):
    for p in range(len(pair)):
        i, j = pair[p]
        normal = 0.0
        for axis in range(3):
            normal += direction[p, axis] * (velocity[i, axis] - velocity[j, axis])
        for axis in range(3):
            value = across[p] * (velocity[i, axis] - velocity[j, axis])
            value += (along[p] - across[p]) * normal * direction[p, axis]
            # A pair's velocities are plus and minus half their difference, and their mean.
            force[i, axis] += 0.5 * value
            force[j, axis] -= 0.5 * value
