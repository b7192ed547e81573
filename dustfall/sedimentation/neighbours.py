"""The nearest neighbours of every particle in a periodic cube.

What the search returns depends on the positions alone: distances are those between nearest images,
computed in one way everywhere, and where two are equal the particle with the lower row comes first.
"""

import numpy as np
from numba import njit

from dustfall.sedimentation.blocks import Blocks
from dustfall.spheres import checked_numbers
from dustfall.suspension.cube import folded
from dustfall.units import NEIGHBOURS

EXPECTED_WITHIN = 2.8
"""Particles that a search which knows nothing expects within its radius, for each one wanted."""

GROWTH = 1.5
"""By what a search is widened that met too few particles."""

FARTHEST = 1e9
"""Largest magnitude of a coordinate, in sides of the cube: folded back, it is exact to 1e-7 of the
side."""

SIDES = (1e-100, 1e90)
"""Smallest and largest side of a cube: squares of all distances are numbers still."""

_ROUNDING = 1e-9  # of a cell: keeps rounding of cell faces from hiding a particle


def nearest_neighbours(
    position: np.ndarray, box_length: float, number: int = NEIGHBOURS
) -> tuple[np.ndarray, np.ndarray]:
    """Find the nearest neighbours of every particle, exactly, in a periodic cube.

    Every other particle counts once, at its nearest image. Particles are sorted into cells; a
    search covers the cells within a radius and widens until it holds enough.

    Parameters
    ----------
    position : (n, 3), wrapped into the cube or not
    box_length : side of the cube, in the unit of `position`
    number : of neighbours, k, an integer of at least 1

    Returns
    -------
    vectors : (n, k, 3) from the particle to its neighbours, nearest first
    index : (n, k) int32, the neighbours' rows in `position`

    Raises
    ------
    ValueError : k out of range, no more than k particles, wrong shape, positions that are not
        finite or beyond `FARTHEST` sides, a `box_length` outside `SIDES`.
    """
    position = check_positions(position, box_length, number)
    n = len(position)
    wrapped = folded(position, box_length)
    cells = sort_by_cell(wrapped, box_length)
    index = np.empty((n, number), np.int32)
    with Blocks(n) as blocks:
        blocks.run(lambda first, last: _search(first, last, wrapped, box_length, cells, index))
    return separations(wrapped, index, box_length, np.arange(n)), index


def check_positions(position: np.ndarray, box_length: float, number: int) -> np.ndarray:
    """Return `position` as contiguous float64 (n, 3), or raise ValueError by name."""
    if not isinstance(number, int | np.integer) or number < 1:
        raise ValueError(
            f"the number of neighbours is {number}: it has to be an integer of at least 1, and "
            "smaller than that of particles"
        )
    position = checked_numbers("positions", position)
    if position.ndim != 2 or position.shape[1] != 3:
        raise ValueError(f"positions have shape {position.shape}: (n, 3) is needed")
    if len(position) <= number:
        raise ValueError(
            f"{len(position)} particles: at least {number + 1} are needed for each to have "
            f"{number} neighbours"
        )
    if not SIDES[0] <= box_length <= SIDES[1]:
        raise ValueError(
            f"box_length is {box_length}: it has to be positive and finite, {SIDES[0]:g} to "
            f"{SIDES[1]:g}"
        )
    allowed = np.abs(position) <= FARTHEST * box_length
    if not allowed.all():
        row = np.flatnonzero(~allowed.all(axis=1))[0]
        raise ValueError(
            f"position of particle {row} is {position[row]}: it has to be finite, within "
            f"{FARTHEST:g} sides of the cube"
        )
    return position


@njit(cache=True, nogil=True)
def _nearest_image(difference, box_length):
    """A difference of two wrapped coordinates, taken to the nearest image."""
    if difference > 0.5 * box_length:
        return difference - box_length
    if difference < -0.5 * box_length:
        return difference + box_length
    return difference


@njit(cache=True, nogil=True)
def distance2(wrapped, i, j, box_length):
    """Square of the distance between particles `i` and `j`: the one that all searches compare."""
    x = _nearest_image(wrapped[j, 0] - wrapped[i, 0], box_length)
    y = _nearest_image(wrapped[j, 1] - wrapped[i, 1], box_length)
    z = _nearest_image(wrapped[j, 2] - wrapped[i, 2], box_length)
    return x * x + y * y + z * z


@njit(cache=True, nogil=True)
def separations(wrapped, index, box_length, rows):
    """Vectors (m, k, 3) from the particles `rows` (m,) to their neighbours."""
    vectors = np.empty((len(rows), index.shape[1], 3))
    for k in range(len(rows)):
        i = rows[k]
        for slot in range(index.shape[1]):
            j = index[i, slot]
            for axis in range(3):
                difference = wrapped[j, axis] - wrapped[i, axis]
                vectors[k, slot, axis] = _nearest_image(difference, box_length)
    return vectors


@njit(cache=True, nogil=True)
def sort_by_cell(wrapped, box_length):
    """Sort particles into cubic cells of one particle on average.

    Returns the number of cells along a side, the rows in the order of their cells, their positions
    in that order, and each cell's first place in it.
    """
    n = len(wrapped)
    cells = max(1, int(n ** (1 / 3)))
    scale = cells / box_length
    cell = np.empty(n, np.int32)
    first = np.zeros(cells**3 + 1, np.int32)
    for i in range(n):
        number = 0
        for axis in range(3):
            number = number * cells + min(int(wrapped[i, axis] * scale), cells - 1)
        cell[i] = number
        first[number + 1] += 1
    for number in range(cells**3):
        first[number + 1] += first[number]
    place = first[:-1].copy()
    row = np.empty(n, np.int32)
    point = np.empty((n, 3))
    for i in range(n):
        k = place[cell[i]]
        place[cell[i]] += 1
        row[k] = i
        point[k] = wrapped[i]
    return cells, row, point, first


@njit(cache=True, nogil=True)
def collect(i, reach, wrapped, box_length, cells, met, square):
    """Find all particles within `reach` of particle `i`, itself included, in no special order.

    Writes their rows to `met` and the squares of their distances to `square`; returns how many.
    """
    number, row, point, first = cells
    scale = number / box_length
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for axis in range(3):
        low[axis] = np.floor((wrapped[i, axis] - reach) * scale - _ROUNDING)
        high[axis] = np.floor((wrapped[i, axis] + reach) * scale + _ROUNDING)
        if high[axis] - low[axis] >= number:  # every cell once, none as two images
            low[axis], high[axis] = 0, number - 1
    # Cells that follow each other along z do so in memory: one run, or two where it meets a face.
    runs = 2 if low[2] < 0 or high[2] >= number else 1
    x, y, z = wrapped[i]
    limit = reach * reach
    count = 0
    for cx in range(low[0], high[0] + 1):
        for cy in range(low[1], high[1] + 1):
            column = ((cx % number) * number + cy % number) * number
            for run in range(runs):
                if runs == 1:
                    bottom, top = low[2], high[2]
                elif run == 0:
                    bottom, top = low[2] % number, number - 1
                else:
                    bottom, top = 0, high[2] % number
                for k in range(first[column + bottom], first[column + top + 1]):
                    dx = _nearest_image(point[k, 0] - x, box_length)
                    dy = _nearest_image(point[k, 1] - y, box_length)
                    dz = _nearest_image(point[k, 2] - z, box_length)
                    met[count] = row[k]
                    square[count] = dx * dx + dy * dy + dz * dz
                    count += square[count] <= limit
    return count


@njit(cache=True, nogil=True)
def insert(j, square, nearest, chosen, count):
    """Put a particle into its place in a list ordered by distance; return the list's length.

    `nearest` and `chosen` hold squares of distances and rows; a full list drops its last.
    """
    slot = count
    if count == len(nearest):
        slot = count - 1
        if not _before(square, j, nearest[slot], chosen[slot]):
            return count
    while slot > 0 and _before(square, j, nearest[slot - 1], chosen[slot - 1]):
        nearest[slot] = nearest[slot - 1]
        chosen[slot] = chosen[slot - 1]
        slot -= 1
    nearest[slot] = square
    chosen[slot] = j
    return min(count + 1, len(nearest))


@njit(cache=True, nogil=True)
def _before(square, j, other_square, other):
    return square < other_square or (square == other_square and j < other)


@njit(cache=True, nogil=True)
def first_reach(box_length, particles, number):
    """Radius of a search that knows nothing but how many particles are wanted."""
    return box_length * (EXPECTED_WITHIN * number / (4.0 / 3.0 * np.pi * particles)) ** (1 / 3)


@njit(cache=True, nogil=True)
def nearest_within(i, number, reach, wrapped, box_length, cells, met, square, nearest, chosen):
    """List the particles nearest to `i`, at least `number`, nearest first.

    The list takes those within `reach`, or within a larger radius where there are too few, as far
    as there is room in `nearest` (squares of distances) and `chosen` (rows). Returns how many are
    listed, and a distance that no particle left out is nearer than.
    """
    while True:
        found = collect(i, reach, wrapped, box_length, cells, met, square)
        if found > number:
            break
        reach *= GROWTH
    count = 0
    for k in range(found):
        if met[k] != i:
            count = insert(met[k], square[k], nearest, chosen, count)
    if count == len(wrapped) - 1:
        bound = np.inf
    elif count == found - 1:
        bound = reach
    else:
        bound = np.sqrt(nearest[count - 1])
    return count, bound


@njit(cache=True, nogil=True)
def _search(first, last, wrapped, box_length, cells, index):
    """The nearest of the particles at places `first` to `last - 1` of the cells' order."""
    n, number = index.shape
    met, square = np.empty(n + 1, np.int32), np.empty(n + 1)
    nearest = np.empty(number)
    for i in cells[1][first:last]:
        reach = first_reach(box_length, n, number)
        nearest_within(i, number, reach, wrapped, box_length, cells, met, square, nearest, index[i])
