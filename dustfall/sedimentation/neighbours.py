"""The five nearest neighbours of every particle in a periodic cube."""

import numpy as np
from numba import njit

from dustfall.forces.frames import NEIGHBOURS

POINTS_PER_CELL = 2
"""Measured optimum: fewer means more cells to visit, more means more distances to compare."""

SAFETY = 1 - 1e-9
"""Keeps rounding of cell faces from declaring a search complete that is not."""


def nearest_neighbours(position: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Find the five nearest neighbours of every particle, exactly, in a periodic cube.

    Every other particle counts once, at its nearest image. Particles are sorted into cells; a
    search covers the 27 cells around a particle and widens until no uncovered point can be nearer
    than the fifth neighbour found.

    Parameters
    ----------
    position : (n, 3), wrapped into the cube or not
    side : of the cube, in the unit of `position`

    Returns
    -------
    vectors : (n, 5, 3) from the particle to its neighbours, nearest first
    index : (n, 5) int32, the neighbours' rows in `position`

    Raises
    ------
    ValueError : fewer than six particles, wrong shape, positions not finite, `side` not positive.
    """
    position = np.ascontiguousarray(position, dtype=np.float64)
    if position.ndim != 2 or position.shape[1] != 3:
        raise ValueError(f"positions have shape {position.shape}: (n, 3) is needed")
    if len(position) <= NEIGHBOURS:
        raise ValueError(
            f"{len(position)} particles: at least {NEIGHBOURS + 1} are needed for each to have "
            f"{NEIGHBOURS} neighbours"
        )
    if not (np.isfinite(side) and side > 0):
        raise ValueError(f"side of the cube is {side}: it has to be positive and finite")
    if not np.isfinite(position).all():
        row = np.flatnonzero(~np.isfinite(position).all(axis=1))[0]
        raise ValueError(f"position of particle {row} is {position[row]}: it has to be finite")
    cells = max(1, int((len(position) / POINTS_PER_CELL) ** (1 / 3)))
    return _nearest(position, float(side), cells)


@njit(cache=True)
def _sort_by_cell(position, side, cells):
    """Counting sort: positions wrapped and ordered by cell, their rows, the cells' first places."""
    n = len(position)
    wrapped = np.empty((n, 3))
    cell = np.empty(n, np.int64)
    first = np.zeros(cells**3 + 1, np.int64)
    for i in range(n):
        number = 0
        for axis in range(3):
            x = position[i, axis] - side * np.floor(position[i, axis] / side)
            if x >= side:  # a tiny negative coordinate wraps onto the far face by rounding
                x = 0.0
            wrapped[i, axis] = x
            number = number * cells + min(int(x / side * cells), cells - 1)
        cell[i] = number
        first[number + 1] += 1
    for number in range(cells**3):
        first[number + 1] += first[number]
    place = first[:-1].copy()
    point = np.empty((3, n))
    row = np.empty(n, np.int32)
    for i in range(n):
        k = place[cell[i]]
        place[cell[i]] += 1
        row[k] = i
        point[:, k] = wrapped[i]
    return point, row, first


@njit(cache=True)
def _gather(low, high, side, cells, point, first, candidate, place):
    """Copy the points in the cells `low` to `high`, each shifted to the image beside them."""
    count = 0
    for cx in range(low[0], high[0] + 1):
        image_x = -1 if cx < 0 else (1 if cx >= cells else 0)
        for cy in range(low[1], high[1] + 1):
            image_y = -1 if cy < 0 else (1 if cy >= cells else 0)
            column = ((cx - image_x * cells) * cells + cy - image_y * cells) * cells
            # Cells that follow each other along z do so in memory too, within one image.
            for image_z in range(-1, 2):
                bottom = max(low[2] - image_z * cells, 0)
                top = min(high[2] - image_z * cells, cells - 1)
                if bottom > top:
                    continue
                for k in range(first[column + bottom], first[column + top + 1]):
                    candidate[0, count] = point[0, k] + image_x * side
                    candidate[1, count] = point[1, k] + image_y * side
                    candidate[2, count] = point[2, k] + image_z * side
                    place[count] = k
                    count += 1
    return count


@njit(cache=True)
def _gather_all(k, side, point, candidate, place):
    """Copy all points, each shifted to its image nearest to point `k`."""
    n = point.shape[1]
    for j in range(n):
        place[j] = j
        for axis in range(3):
            x = point[axis, j]
            candidate[axis, j] = x - side * np.rint((x - point[axis, k]) / side)
    return n


@njit(cache=True)
def _select(k, count, point, candidate, place, distance2, nearest, chosen):
    """Choose the five candidates nearest to point `k`; return the fifth distance squared."""
    x, y, z = point[0, k], point[1, k], point[2, k]
    for j in range(count):
        distance2[j] = (
            (candidate[0, j] - x) ** 2 + (candidate[1, j] - y) ** 2 + (candidate[2, j] - z) ** 2
        )
    nearest[:] = np.inf
    fifth = np.inf
    for j in range(count):
        if distance2[j] < fifth and place[j] != k:
            slot = NEIGHBOURS - 1
            while slot > 0 and nearest[slot - 1] > distance2[j]:
                nearest[slot] = nearest[slot - 1]
                chosen[slot] = chosen[slot - 1]
                slot -= 1
            nearest[slot] = distance2[j]
            chosen[slot] = j
            fifth = nearest[NEIGHBOURS - 1]
    return fifth


@njit(cache=True)
def _nearest(position, side, cells):
    n = len(position)
    point, row, first = _sort_by_cell(position, side, cells)
    width = side / cells
    vectors = np.empty((n, NEIGHBOURS, 3))
    indices = np.empty((n, NEIGHBOURS), np.int32)
    candidate = np.empty((3, n))
    place = np.empty(n, np.int64)
    distance2 = np.empty(n)
    nearest = np.empty(NEIGHBOURS)
    chosen = np.empty(NEIGHBOURS, np.int64)
    cell = np.empty(3, np.int64)
    low = np.empty(3, np.int64)
    high = np.empty(3, np.int64)
    for number in range(cells**3):
        cell[0], cell[1], cell[2] = number // cells**2, number // cells % cells, number % cells
        beside = 0  # how many candidates are those of the 27 cells around; 0 when not gathered
        for k in range(first[number], first[number + 1]):
            fifth = np.inf
            complete = False
            if cells >= 3:
                if beside == 0:
                    low[:] = cell - 1
                    high[:] = cell + 1
                    beside = _gather(low, high, side, cells, point, first, candidate, place)
                fifth = _select(k, beside, point, candidate, place, distance2, nearest, chosen)
                # No point outside the 27 cells is nearer than one cell plus this margin.
                margin = width
                for axis in range(3):
                    inside = point[axis, k] - cell[axis] * width
                    margin = min(margin, inside, width - inside)
                covered = (width + margin) * SAFETY
                complete = fifth <= covered * covered
            if not complete:
                beside = 0
                # The fifth candidate so far bounds where the true five are.
                reach = np.sqrt(fifth) / SAFETY if np.isfinite(fifth) else side
                widest = 0
                for axis in range(3):
                    low[axis] = np.floor((point[axis, k] - reach) / width)
                    high[axis] = np.floor((point[axis, k] + reach) / width)
                    widest = max(widest, high[axis] - low[axis] + 1)
                if widest <= cells:
                    count = _gather(low, high, side, cells, point, first, candidate, place)
                else:  # a cell would be met twice, as two images
                    count = _gather_all(k, side, point, candidate, place)
                _select(k, count, point, candidate, place, distance2, nearest, chosen)
            for slot in range(NEIGHBOURS):
                j = chosen[slot]
                indices[row[k], slot] = row[place[j]]
                for axis in range(3):
                    vectors[row[k], slot, axis] = candidate[axis, j] - point[axis, k]
    return vectors, indices
