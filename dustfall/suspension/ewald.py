"""Velocities of all spheres of a periodic suspension under given forces, without a matrix."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import scipy.fft
from numba import njit

from dustfall.spheres import checked_positions
from dustfall.suspension.cube import folded
from dustfall.suspension.rotne_prager import pair_coefficients
from dustfall.suspension.splitting import Splitting, choose_splitting
from dustfall.suspension.window import fold, unfold, window_kernels, window_polynomials

PAIR_NUMBERS = 5
"""Stored for a pair: across, along / r^2, and the three components of r."""

FEWEST_CELLS = 4
"""Along a side, that particles are counted in to see whether they crowd."""

CROWDED = 2.0
"""Density around a particle over the mean density from which on the splitting follows it."""


class PeriodicMobility:
    """Rotne-Prager mobility of n spheres and all their images in a periodic cube, as a product.

    The tensor is that of `pair_coefficients`, overlapping spheres included. The wave of wavenumber
    zero is left out: spheres and fluid together have no net flux, which is how a suspension settles
    in a vessel with a bottom. `periodic_mobility` is the same as a matrix.

    Memory is linear in the number of particles: about 1 kB a particle at a tolerance of 1e-3, and
    2 kB at 1e-6. It is counted before it is taken.

    Parameters
    ----------
    positions : (n, 3) in d_p, n >= 1, wrapped or not; spheres may overlap
    side : of the cube, d_p
    tolerance : error of the velocities over the forces, root mean square, 1e-8 to 0.1; from 1e-5
        on the product is in single precision
    threads : that share the work; their number changes no bit of a result
    splitting : as from `choose_splitting`, by default the cheapest that keeps the tolerance

    Attributes
    ----------
    splitting, tolerance, side : as above
    bytes : of memory that the object and a product take

    Raises
    ------
    ValueError : positions of another shape or not finite, `side` not positive, `tolerance` out of
        range, `threads` below one, `splitting` for another side.
    MemoryError : the machine has less memory than this needs.

    Example
    -------
    >>> mobility = PeriodicMobility([[0.0, 0.0, 0.0]], side=10.0, tolerance=1e-8)
    >>> mobility.velocities([[0.0, 0.0, -1.0]]).round(6)
    array([[ 0.      ,  0.      , -0.858659]])
    """

    def __init__(
        self,
        positions,
        side: float,
        tolerance: float = 1e-3,
        threads: int = 1,
        splitting: Splitting | None = None,
    ):
        positions = checked_positions(positions)
        side = float(side)
        if not (np.isfinite(side) and side > 0):
            raise ValueError(f"side of the cube is {side}: it has to be positive and finite")
        if threads < 1:
            raise ValueError(f"threads is {threads}: it has to be at least 1")
        inside = folded(positions, side)
        if splitting is None:
            splitting = _splitting_for(inside, side, tolerance)
        elif splitting.side != side:
            raise ValueError(f"splitting is for a side of {splitting.side}, not {side}")
        self.splitting, self.side, self.tolerance = splitting, side, splitting.tolerance
        self._threads = threads

        cells = max(1, int(side / splitting.reach))
        cell, first = _sort_key(inside, side, cells)
        self._order = np.argsort(cell, kind="stable")
        point = np.ascontiguousarray(inside[self._order].T)
        self._slabs = _slabs(first, cells, splitting)

        n = len(positions)
        pairs = np.zeros(n + 1, np.int64)
        self._share(
            n, lambda low, high: _count_pairs(low, high, point, side, splitting.reach, first, pairs)
        )
        self._first_pair = np.cumsum(pairs)
        self.bytes = _bytes(n, int(self._first_pair[-1]), splitting)
        _check_memory(self.bytes, n)

        dtype = splitting.dtype
        self._pair = np.empty((self._first_pair[-1], PAIR_NUMBERS), dtype)
        self._other = np.empty(self._first_pair[-1], np.int32)
        table, reach = splitting.smooth_pairs, splitting.reach
        most = int(pairs.max())
        self._share(
            n,
            lambda low, high: _list_pairs(
                low, high, point, side, reach, first, most, table,
                self._first_pair, self._other, self._pair,
            ),
        )  # fmt: skip
        self._itself = dtype(1.0 - table[0, 0])

        grid, points = splitting.grid, splitting.points
        weigh, self._spread, self._interpolate = window_kernels(points)
        self._base = np.empty((n, 3), np.int32)
        self._weight = np.empty((n, 3, points), dtype)
        polynomials = window_polynomials(points, splitting.window_steepness)
        point = point.T.copy()
        self._share(
            n,
            lambda low, high: weigh(
                low, high, point, grid, side / grid, polynomials, self._base, self._weight
            ),
        )
        self._field = np.empty((grid, grid, 3 * (grid + points)), dtype)

    def velocities(self, forces) -> np.ndarray:
        """Velocities (n, 3) under `forces` (n, 3), in units of an isolated sphere's mobility.

        Raises ValueError for forces of another shape or not finite.
        """
        forces = np.asarray(forces)
        if forces.shape != (len(self._order), 3):
            raise ValueError(f"forces have shape {forces.shape}: ({len(self._order)}, 3) is needed")
        if not np.isfinite(forces).all():
            raise ValueError("forces hold a value that is not finite")
        velocities = np.empty(forces.shape)
        velocities[self._order] = self.product(forces[self._order])
        return velocities

    @property
    def order(self) -> np.ndarray:
        """Rows (n,) of the positions in the order of `product`, neighbours close together."""
        return self._order

    def product(self, forces: np.ndarray, influence: np.ndarray | None = None) -> np.ndarray:
        """Velocities under forces, both (n, 3) in `order` and in the splitting's precision.

        influence: in place of the splitting's, for a smooth part other than quasi-steady Stokes
        flow.
        """
        forces = np.ascontiguousarray(forces, self.splitting.dtype)
        waves = self.waves(forces, self.splitting.influence if influence is None else influence)
        velocities = self.at_particles(waves)
        n = len(forces)
        self._share(
            n,
            lambda low, high: _add_pairs(
                low, high, self._first_pair, self._other, self._pair, self._itself, forces,
                velocities,
            ),
        )  # fmt: skip
        return velocities

    def waves(self, forces: np.ndarray, influence: np.ndarray) -> np.ndarray:
        """Waves (M, M, M // 2 + 1, 3) of the flow that forces in `order` cause, smooth part."""
        forces = np.ascontiguousarray(forces, self.splitting.dtype)
        self._field[:] = 0
        slabs = self._slabs
        for colour in (0, 1):
            # Slabs of one colour reach into none of each other, so threads meet nowhere.
            self._each(
                [
                    lambda low=low, high=high: self._spread(
                        low, high, self._base, self._weight, forces, self._field
                    )
                    for low, high in zip(slabs[colour:-1:2], slabs[colour + 1 :: 2], strict=True)
                ]
            )
        fold(self._field)
        waves = scipy.fft.rfftn(self._grid, axes=(0, 1, 2), workers=self._threads)
        whole, half = self.splitting.wavenumbers
        self._share(
            len(whole), lambda low, high: _transverse(low, high, waves, influence, whole, half)
        )
        return waves

    def at_particles(self, waves: np.ndarray) -> np.ndarray:
        """Velocities (n, 3) in `order` of a flow of waves, which are overwritten."""
        grid, n = self.splitting.grid, len(self._order)
        self._grid[:] = scipy.fft.irfftn(
            waves, s=(grid,) * 3, axes=(0, 1, 2), norm="forward", overwrite_x=True,
            workers=self._threads,
        )  # fmt: skip
        unfold(self._field)
        velocities = np.empty((n, 3), self.splitting.dtype)
        self._share(
            n,
            lambda low, high: self._interpolate(
                low, high, self._base, self._weight, self._field, velocities
            ),
        )
        return velocities

    @property
    def _grid(self):
        """The field without its overlap, (M, M, M, 3)."""
        grid = self.splitting.grid
        return self._field.reshape(grid, grid, -1, 3)[:, :, :grid]

    def _share(self, n, work):
        """Call work(low, high) on as many parts of range(n) as there are threads."""
        bounds = [n * part // self._threads for part in range(self._threads + 1)]
        self._each([lambda low=low, high=high: work(low, high) for low, high in pairwise(bounds)])

    def _each(self, calls):
        if self._threads == 1:
            for call in calls:
                call()
        else:
            with ThreadPoolExecutor(self._threads) as pool:
                for done in [pool.submit(call) for call in calls]:
                    done.result()


def _splitting_for(positions, side, tolerance):
    """The cheapest splitting, for the density that the particles see around them."""
    n, crowding = len(positions), 1.0
    while True:
        splitting = choose_splitting(n, side, tolerance, crowding)
        cells = max(FEWEST_CELLS, int(side / splitting.reach))
        # Pairs within a cell, of a Poisson cloud: the square of the particles expected there.
        number = np.bincount(_sort_key(positions, side, cells)[0]).astype(float)
        found = (number * (number - 1)).sum() * cells**3 / n**2
        if found <= CROWDED * crowding:
            return splitting
        # Powers of two: particles that move do not change the splitting at every step.
        crowding = float(2 ** np.ceil(np.log2(found)))


def _sort_key(positions, side, cells):
    """Cell (n,) of each particle, z fastest, and the first place of each cell (cells^3 + 1,)."""
    index = np.minimum((positions * (cells / side)).astype(np.int64), cells - 1)
    cell = (index[:, 0] * cells + index[:, 1]) * cells + index[:, 2]
    first = np.zeros(cells**3 + 1, np.int64)
    first[1:] = np.cumsum(np.bincount(cell, minlength=cells**3))
    return cell, first


def _slabs(first, cells, splitting):
    """Bounds of slabs of particles that are wider than a window: an even number, or one."""
    width = splitting.side / cells
    window = (splitting.points + 1) * splitting.side / splitting.grid
    number = cells // int(np.ceil(window / width))
    number -= number % 2
    bounds = [cells * slab // number for slab in range(number)] if number else [0]
    return [int(first[bound * cells**2]) for bound in bounds] + [int(first[-1])]


def _bytes(particles, pairs, splitting):
    item = np.dtype(splitting.dtype).itemsize
    grid, points = splitting.grid, splitting.points
    listed = pairs * (PAIR_NUMBERS * item + 4)
    # Forces and velocities, in both orders and precisions, count as twelve numbers.
    each = particles * (3 * points * item + 3 * 4 + 12 * 8 + 4 * 8)
    fields = 3 * item * (grid**2 * (grid + points) + grid**3 + 2 * grid**2 * (grid // 2 + 1))
    return listed + each + fields + item * grid**2 * (grid // 2 + 1)


def _check_memory(needed, particles):
    there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > there:
        raise MemoryError(
            f"the mobility of {particles} spheres needs {needed / 2**30:.3g} GiB of memory, and "
            f"the machine has {there / 2**30:.3g} GiB: fewer particles or a larger tolerance "
            "need less"
        )


@njit(cache=True, nogil=True)
def _runs(x, y, z, side, reach, cells, run):
    """Runs of cells that can hold particles within reach of a point, images included.

    Fills run (m, 5): first and last cell of a run along z, and the shift of its particles in units
    of the side. Returns their number.
    """
    scale = cells / side
    width = int(np.ceil(reach * scale))
    a, b, c = int(x * scale), int(y * scale), int(z * scale)
    a, b, c = min(a, cells - 1), min(b, cells - 1), min(c, cells - 1)
    count = 0
    for i in range(a - width, a + width + 1):
        for j in range(b - width, b + width + 1):
            column = ((i % cells) * cells + j % cells) * cells
            low = c - width
            while low <= c + width:
                shift = low // cells
                high = min(c + width, (shift + 1) * cells - 1)
                run[count, 0] = column + low - shift * cells
                run[count, 1] = column + high - shift * cells
                run[count, 2], run[count, 3], run[count, 4] = i // cells, j // cells, shift
                count += 1
                low = high + 1
    return count


@njit(cache=True, nogil=True)
def _new_runs(reach, side, cells):
    width = 2 * int(np.ceil(reach * cells / side)) + 1
    return np.empty((width * width * (width + 1), 5), np.int64)


@njit(cache=True, nogil=True)
def _count_pairs(low, high, point, side, reach, first, pairs):
    """Set pairs[i + 1] to the number of particles and images within reach of particle i."""
    cells = round((len(first) - 1) ** (1 / 3))
    run = _new_runs(reach, side, cells)
    px, py, pz = point
    for i in range(low, high):
        x, y, z = px[i], py[i], pz[i]
        found = -1  # not the particle itself
        for r in range(_runs(x, y, z, side, reach, cells, run)):
            sx, sy, sz = x - side * run[r, 2], y - side * run[r, 3], z - side * run[r, 4]
            for j in range(first[run[r, 0]], first[run[r, 1] + 1]):
                # To the bit as in `_list_pairs`, for which reason neither may reorder sums.
                dx, dy, dz = px[j] - sx, py[j] - sy, pz[j] - sz
                found += dx * dx + dy * dy + dz * dz < reach * reach
        pairs[i + 1] = found


@njit(cache=True, nogil=True)
def _list_pairs(low, high, point, side, reach, first, most, table, first_pair, other, pair):
    """List the pairs of particles `low` to `high - 1` with their tensors, less the smooth part."""
    cells = round((len(first) - 1) ** (1 / 3))
    run = _new_runs(reach, side, cells)
    px, py, pz = point
    scale = (len(table) - 1) / reach
    # One place more than there are pairs: candidates are written first, and kept if near.
    found, image = np.empty(most + 2, np.int32), np.empty(most + 2, np.int32)
    for i in range(low, high):
        x, y, z = px[i], py[i], pz[i]
        count = 0
        for r in range(_runs(x, y, z, side, reach, cells, run)):
            sx, sy, sz = x - side * run[r, 2], y - side * run[r, 3], z - side * run[r, 4]
            away = run[r, 2] != 0 or run[r, 3] != 0 or run[r, 4] != 0
            for j in range(first[run[r, 0]], first[run[r, 1] + 1]):
                dx, dy, dz = px[j] - sx, py[j] - sy, pz[j] - sz
                found[count], image[count] = j, r
                near = dx * dx + dy * dy + dz * dz < reach * reach
                count += near & ((i != j) | away)
        for k in range(first_pair[i + 1] - first_pair[i]):
            j, r = found[k], image[k]
            dx = px[j] - (x - side * run[r, 2])
            dy = py[j] - (y - side * run[r, 3])
            dz = pz[j] - (z - side * run[r, 4])
            across, along = _rest(dx * dx + dy * dy + dz * dz, scale, table)
            q = first_pair[i] + k
            other[q] = j
            pair[q, 0], pair[q, 1] = across, along
            pair[q, 2], pair[q, 3], pair[q, 4] = dx, dy, dz


@njit(cache=True, nogil=True, fastmath=True)
def _rest(square, scale, table):
    """A pair's tensor less its smooth part: across, and along over the square of the distance."""
    distance = np.sqrt(square)
    across, along = pair_coefficients(distance)
    place = distance * scale
    lowest = min(max(int(place), 1), len(table) - 3)
    t = place - lowest
    # Cubic through the two steps on either side.
    w0 = -t * (t - 1) * (t - 2) / 6
    w1 = (t + 1) * (t - 1) * (t - 2) / 2
    w2 = -(t + 1) * t * (t - 2) / 2
    w3 = (t + 1) * t * (t - 1) / 6
    for k, w in ((lowest - 1, w0), (lowest, w1), (lowest + 1, w2), (lowest + 2, w3)):
        across -= w * table[k, 0]
        along -= w * table[k, 1]
    return across, along / square if square > 0.0 else 0.0


@njit(cache=True, nogil=True, fastmath=True)
def _add_pairs(low, high, first_pair, other, pair, itself, force, velocity):
    for i in range(low, high):
        vx, vy, vz = itself * force[i, 0], itself * force[i, 1], itself * force[i, 2]
        for q in range(first_pair[i], first_pair[i + 1]):
            j = other[q]
            fx, fy, fz = force[j, 0], force[j, 1], force[j, 2]
            across, x, y, z = pair[q, 0], pair[q, 2], pair[q, 3], pair[q, 4]
            along = pair[q, 1] * (x * fx + y * fy + z * fz)
            vx += across * fx + along * x
            vy += across * fy + along * y
            vz += across * fz + along * z
        velocity[i, 0] += vx
        velocity[i, 1] += vy
        velocity[i, 2] += vz


@njit(cache=True, nogil=True, fastmath=True)
def _transverse(low, high, waves, influence, whole, half):
    """Turn waves of forces into those of the flow: influence * (1 - k k / k^2)."""
    for i in range(low, high):
        for j in range(len(whole)):
            for m in range(len(half)):
                factor = influence[i, j, m]
                wave = waves[i, j, m]
                if factor == 0:
                    wave[:] = 0
                else:
                    x, y, z = whole[i], whole[j], half[m]
                    along = (x * wave[0] + y * wave[1] + z * wave[2]) / (x * x + y * y + z * z)
                    wave[0] = factor * (wave[0] - along * x)
                    wave[1] = factor * (wave[1] - along * y)
                    wave[2] = factor * (wave[2] - along * z)
