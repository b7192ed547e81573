"""The Rotne-Prager tensor of a pair, and the forces on any number of spheres by its inverse.

Mobilities are in units of an isolated sphere's, lengths in d_p.
"""

import numpy as np
from numba import njit

from dustfall.spheres import checked_positions, flow_direction
from dustfall.units import STOKES_DRAG


@njit(cache=True, nogil=True)
def pair_coefficients(distance):
    """Mobility of a pair: coefficients of the unit tensor and of the dyad of the unit vector.

    Rotne and Prager (1969), and for spheres that overlap, at a distance [d_p] below one, Yamakawa
    (1970): positive definite for any arrangement.
    """
    if distance > 1.0:
        square = 1.0 / distance**2
        return 0.375 / distance * (1.0 + square / 6.0), 0.375 / distance * (1.0 - square / 2.0)
    return 1.0 - 0.5625 * distance, 0.1875 * distance


@njit(cache=True)
def free_mobility(centres):
    """Mobility (3n, 3n) of spheres at centres (n, 3) in unbounded fluid, no two at one place."""
    n = len(centres)
    mobility = np.eye(3 * n)
    for i in range(n):
        for j in range(i):
            separation = centres[i] - centres[j]
            distance = np.sqrt(np.sum(separation**2))
            across, along = pair_coefficients(distance)
            for a in range(3):
                for b in range(3):
                    value = along * (separation[a] / distance) * (separation[b] / distance)
                    if a == b:
                        value += across
                    mobility[3 * i + a, 3 * j + b] = mobility[3 * j + b, 3 * i + a] = value
    return mobility


def rotne_prager_forces(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Forces on any number of fixed spheres from the inverted Rotne-Prager mobility.

    centres: (n, 3) [d_p]; spheres may overlap. flow: (3,), velocity far away; forces are made
    dimensionless by its magnitude. Returns (n, 3) in Re_p c_D: an isolated sphere feels 24 along
    the flow.
    Raises ValueError for another shape, a value that is not finite, or coincident centres.
    """
    centres, flow = checked_positions(centres), flow_direction(flow)
    order = np.lexsort(centres.T)
    same = np.flatnonzero((np.diff(centres[order], axis=0) == 0.0).all(axis=1))
    if len(same):
        i, j = sorted(order[same[0] : same[0] + 2].tolist())
        raise ValueError(f"spheres {i} and {j} have the same centre")
    velocity = np.tile(flow, len(centres))
    return STOKES_DRAG * np.linalg.solve(free_mobility(centres), velocity).reshape(-1, 3)
