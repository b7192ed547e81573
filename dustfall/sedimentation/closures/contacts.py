"""Pairs of particles that overlap, and neighbours that change, counted at each step."""

import numpy as np
from numba import njit

from dustfall.units import CONTACT


@njit(cache=True, nogil=True)
def changed_neighbours(index, before):
    """Count particles whose set of k nearest is another than before; both (n, k), nearest first.

    Returns their number, and the number of those among them that only the farthest changed of: the
    one that left was the farthest before, and the one that came is the farthest now.
    """
    last = index.shape[1] - 1
    fresh = farthest_alone = 0
    for i in range(len(index)):
        came = 0
        for slot in range(last + 1):
            came += not _is_among(index[i, slot], before, i)
        fresh += came > 0
        farthest_alone += (
            came == 1
            and not _is_among(index[i, last], before, i)
            and not _is_among(before[i, last], index, i)
        )
    return fresh, farthest_alone


@njit(cache=True, nogil=True)
def _is_among(j, index, i):
    """Whether `j` is one of the nearest of particle `i`."""
    found = False
    for slot in range(index.shape[1]):
        found |= index[i, slot] == j
    return found


@njit(cache=True, nogil=True)
def contacts(vectors, rows, index):
    """Count what is closer than a diameter, centre to centre.

    `vectors` (n, k, 3) from the particles `rows` (n,), all of them in any order, to their
    neighbours; `index` (n, k) as of `NeighbourList`.

    Returns the pairs of particles of which one is among the other's nearest, and the neighbours
    that the force model sees below contact (of one pair: one or two).
    """
    pairs = seen = 0
    for k in range(len(rows)):
        i = rows[k]
        for slot in range(index.shape[1]):
            x, y, z = vectors[k, slot, 0], vectors[k, slot, 1], vectors[k, slot, 2]
            if np.sqrt(x * x + y * y + z * z) < CONTACT:
                seen += 1
                j = index[i, slot]
                pairs += i < j or not _is_among(i, index, j)
    return pairs, seen
