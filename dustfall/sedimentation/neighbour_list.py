"""Neighbours of particles that move: what one step's search found, used while it provably holds."""

import numpy as np
from numba import njit

from dustfall.sedimentation.blocks import Blocks
from dustfall.sedimentation.neighbours import (
    check_positions,
    distance2,
    first_reach,
    insert,
    nearest_within,
    separations,
    sort_by_cell,
)
from dustfall.suspension.cube import folded
from dustfall.units import NEIGHBOURS

CANDIDATES = 4.8
"""Most particles that a list holds, for each neighbour wanted; at least two more than these."""

SKIN = 0.45
"""How far beyond the last neighbour a list reaches, in mean spacings."""

FARTHEST_REACH = 2.7
"""Largest radius that a list asks for at first, in radii of a search that knows nothing."""

REORDERED_EVERY = 128
"""Updates after which the lists are put in order again, so that those of neighbours lie together
in memory: with the lists in no order an update takes twice as long."""

_ROUNDING = 1e-12  # of the coordinates: far above the rounding of a step's displacements
_DOWN = 1 - 1e-6  # keeps single precision from rounding a distance up


class NeighbourList:
    """The nearest neighbours of each particle, step after step: exactly `nearest_neighbours`.

    Each particle has a list of candidates, sorted by distance, and a distance that none of the
    others is nearer than. Since the list was made, the particle and any other one have come closer
    by no more than `reach`, the way of the particle plus that of the fastest one at each step,
    measured against the mean drift. So candidates are looked at in their order until the next one's
    old distance, less `reach`, exceeds the new distance of the last neighbour. A particle whose
    list ends before is searched anew. Nothing of this changes what is returned.

    Parameters
    ----------
    particles : more than neighbours
    box_length : side of the cube
    blocks : of the particles
    number : of neighbours, k
    order, updates : of the list that this one continues, to the bits of a model to which the order
        of its scenes matters

    Attributes
    ----------
    index : (n, k) int32, rows of the neighbours, nearest first
    order : (n,) int32, all rows, those of particles near each other together
    searched : particles that the last update searched anew
    """

    def __init__(
        self,
        particles: int,
        box_length: float,
        blocks: Blocks,
        number: int = NEIGHBOURS,
        order: np.ndarray | None = None,
        updates: int = 0,
    ):
        self.box_length = float(box_length)
        self.index = np.empty((particles, number), np.int32)
        self.searched = 0
        self._blocks = blocks
        # Empty until the first update.
        self.order: np.ndarray = np.empty(0, np.int32) if order is None else order
        self._updates = updates
        self._wrapped: np.ndarray | None = None
        self._before: np.ndarray | None = None
        candidates = max(int(np.ceil(CANDIDATES * number)), number + 2)
        self._listed = np.empty((particles, candidates), np.int32)
        self._distance = np.empty((particles, candidates), np.float32)
        self._length = np.zeros(particles, np.int32)
        self._bound = np.zeros(particles)
        self._way = np.zeros(particles)
        self._way_at_search = np.zeros(particles)

    def update(self, position: np.ndarray) -> np.ndarray:
        """Find the neighbours at `position` (n, 3), wrapped or not; return `index`, a new array.

        Raises ValueError for positions that `nearest_neighbours` refuses.
        """
        position = check_positions(position, self.box_length, self.index.shape[1])
        self._wrapped = folded(position, self.box_length)
        if self._before is not None:
            _add_way(self._way, position, self._before, self.box_length)
        self._before = position
        cells = sort_by_cell(self._wrapped, self.box_length)
        if self._updates % REORDERED_EVERY == 0 or not self.order.size:
            self.order = cells[1]
            self._length[:] = 0
        self._updates += 1
        self.index = np.empty_like(self.index)
        searched = np.zeros(len(position), np.bool_)
        self._blocks.run(
            lambda first, last: _renew(
                first,
                last,
                self._wrapped,
                self.box_length,
                cells,
                self.order,
                self._way,
                self._way_at_search,
                self._listed,
                self._distance,
                self._length,
                self._bound,
                self.index,
                searched,
            )
        )
        self.searched = int(searched.sum())
        return self.index

    def vectors(self, rows: np.ndarray) -> np.ndarray:
        """Vectors (m, k, 3) from the particles `rows` (m,) to their neighbours."""
        return separations(self._wrapped, self.index, self.box_length, rows)


@njit(cache=True, nogil=True)
def _add_way(way, position, before, box_length):
    """Add a step's displacements, less their mean, to the `reach` of every list."""
    n = len(position)
    drift = np.zeros(3)
    for i in range(n):
        for axis in range(3):
            drift[axis] += (position[i, axis] - before[i, axis]) / n
    longest = largest = 0.0
    for i in range(n):
        square = 0.0
        for axis in range(3):
            square += (position[i, axis] - before[i, axis] - drift[axis]) ** 2
            largest = max(largest, abs(position[i, axis]))
        way[i] += np.sqrt(square)
        longest = max(longest, square)
    way += np.sqrt(longest) + _ROUNDING * (box_length + largest)


@njit(cache=True, nogil=True)
def _renew(
    first,
    last,
    wrapped,
    box_length,
    cells,
    order,
    way,
    way_at_search,
    listed,
    distance,
    length,
    bound,
    index,
    searched,
):
    """The nearest of the particles whose lists are the rows `first` to `last - 1`."""
    n, number = index.shape
    spacing = box_length / n ** (1 / 3)
    first_radius = first_reach(box_length, n, number)
    met, square = np.empty(n + 1, np.int32), np.empty(n + 1)
    nearest = np.empty(listed.shape[1])
    wanted = nearest[:number]
    for k in range(first, last):
        i = order[k]
        chosen = index[i]
        reach = way[i] - way_at_search[k]
        farthest = np.inf
        count, holds = 0, False
        for entry in range(length[k]):
            if _beyond(distance[k, entry] - reach, farthest):
                holds = True
                break
            j = listed[k, entry]
            count = insert(j, distance2(wrapped, i, j, box_length), wanted, chosen, count)
            if count == number:
                farthest = wanted[number - 1]
        if holds or _beyond(bound[k] - reach, farthest):
            continue
        searched[i] = True
        reach = first_radius
        if farthest < np.inf:  # an upper bound of the last neighbour's distance
            reach = min(np.sqrt(farthest) + SKIN * spacing, FARTHEST_REACH * first_radius)
        length[k], bound[k] = nearest_within(
            i, number, reach, wrapped, box_length, cells, met, square, nearest, listed[k]
        )
        way_at_search[k] = way[i]
        for entry in range(length[k]):
            distance[k, entry] = np.sqrt(nearest[entry]) * _DOWN
        chosen[:] = listed[k, :number]


@njit(cache=True, nogil=True)
def _beyond(distance, square):
    """Whether a lower bound of a distance is above the root of `square`."""
    return distance > 0.0 and distance * distance > square
