"""Where the particles are when a run starts, and how fast."""

from pathlib import Path

import netCDF4
import numpy as np
from numba import njit

from dustfall.sedimentation.neighbours import sort_by_cell
from dustfall.sedimentation.state import State, box_length
from dustfall.streams import Purpose, stream

SATURATION = 0.38
"""Random sequential addition of equal spheres jams near this volume fraction (0.3841)."""

DRAWS_PER_PARTICLE = 10_000
"""Draws after which a packing is given up; at a volume fraction of 0.3 about a hundred suffice."""


START_VELOCITY = {"rest": 0.0, "stokes": -1.0}
"""Vertical velocity at the start [v_s]."""


def random_start(
    particles: int, volume_fraction: float, seed: int, case: int = 0, velocity: str = "rest"
) -> State:
    """Spheres at random places without overlap, all at rest or at the Stokes velocity.

    The places depend on (seed, case) alone. Raises ValueError as `random_positions` and
    `start_from` do.
    """
    draws = stream(Purpose.START, seed, case)
    return start_from(
        random_positions(draws, particles, volume_fraction), volume_fraction, velocity
    )


def start_from(position, volume_fraction: float, velocity="rest") -> State:
    """Start from given places (n, 3) [d_p] and velocities: (n, 3) [v_s], "rest" or "stokes".

    Raises ValueError for another shape, a value that is not finite, or another word.
    """
    position = np.array(position, dtype=np.float64)
    if isinstance(velocity, str):
        if velocity not in START_VELOCITY:
            raise ValueError(f"start is {velocity!r}: allowed are {', '.join(START_VELOCITY)}")
        velocity = np.tile([0.0, 0.0, START_VELOCITY[velocity]], (len(position), 1))
    velocity = np.array(velocity, dtype=np.float64)
    for name, array in {"positions": position, "velocities": velocity}.items():
        if array.shape != (len(position), 3):
            raise ValueError(f"{name} have shape {array.shape}: ({len(position)}, 3) is needed")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} at the start hold a value that is not finite")
    box_length(len(position), volume_fraction)
    return State(position, velocity, volume_fraction)


def random_positions(rng: np.random.Generator, particles: int, volume_fraction: float):
    """Place spheres at random in a periodic cube, one after the other, without overlap.

    Random sequential addition: a draw that overlaps with a sphere already placed is drawn again.

    Returns
    -------
    (n, 3) positions in d_p, within the cube of side `box_length(particles, volume_fraction)`, cell
    by cell

    Raises
    ------
    ValueError : the volume fraction is outside ]0, 0.38[, where random addition jams, or the
        spheres do not fit (phi close to jamming).
    """
    if not 0 < volume_fraction < SATURATION:
        raise ValueError(
            f"volume fraction phi is {volume_fraction}: allowed is 0 < phi < {SATURATION}, where "
            f"random addition without overlap jams"
        )
    length = box_length(particles, volume_fraction)
    # Cells no narrower than a diameter, so that overlaps are among the 27 around a draw.
    cells = max(1, min(int(length), int(np.ceil(particles ** (1 / 3)))))
    position = np.empty((particles, 3))
    head = np.full(cells**3, -1, np.int64)
    following = np.full(particles, -1, np.int64)
    placed = draws = 0
    while placed < particles:
        if draws >= DRAWS_PER_PARTICLE * particles:
            raise ValueError(
                f"{particles} spheres do not fit at volume fraction phi = {volume_fraction}: "
                f"{placed} were placed in {draws} random draws; choose a smaller phi"
            )
        draw = rng.random((particles, 3)) * length
        placed = _add(draw, position, placed, head, following, length, cells)
        draws += particles
    return position[sort_by_cell(position, length)[1]]


def read_start(path: str | Path, particles: int, volume_fraction: float):
    """Read where a run starts: the last frame of a trajectory (.nc), or a table of plain text.

    A trajectory follows the AMBER convention, as those of this package do, with coordinates in d_p
    and, where it has them, velocities in v_s; its cube is the one that `particles` and
    `volume_fraction` give. A table has one particle a line: x y z in d_p, or x y z v_x v_y v_z with
    velocities in v_s; what follows a # is a comment.

    Returns
    -------
    positions (n, 3) in d_p, and velocities (n, 3) in v_s or None

    Raises
    ------
    FileNotFoundError : there is no such file.
    ValueError : the file holds something else, another number of particles or another cube.
    """
    path = Path(path)
    if path.suffix == ".nc":
        with netCDF4.Dataset(path) as file:
            length = box_length(particles, volume_fraction)
            lengths = _last_frame(path, file, "cell_lengths", "d_p")
            if lengths is not None and not np.allclose(lengths, length, rtol=1e-6):
                raise ValueError(
                    f"{path} has a cell of {lengths} d_p: {particles} particles at volume fraction "
                    f"phi = {volume_fraction:g} fill a cube of {length:.6g} d_p"
                )
            positions = _last_frame(path, file, "coordinates", "d_p")
            velocities = _last_frame(path, file, "velocities", "v_s")
        if positions is None:
            raise ValueError(f"{path} has no variable coordinates")
    else:
        table = np.loadtxt(path, ndmin=2)
        if table.shape[1] not in (3, 6):
            raise ValueError(f"{path} has {table.shape[1]} columns: 3 or 6 are needed")
        positions, velocities = table[:, :3], table[:, 3:] if table.shape[1] == 6 else None
    if len(positions) != particles:
        raise ValueError(f"{path} holds {len(positions)} particles: {particles} are needed")
    return positions, velocities


def _last_frame(path, file, name, units):
    """Last frame of a variable in float64; None where there is no such variable."""
    if name not in file.variables:
        return None
    found = getattr(file[name], "units", units)
    if found != units or len(file[name]) == 0:
        raise ValueError(
            f"{path} has {len(file[name])} frames of {name} in {found}: {units} needed"
        )
    return np.asarray(file[name][-1], dtype=np.float64)


@njit(cache=True)
def _add(draw, position, placed, head, following, length, cells):
    """Add the draws that overlap with nothing; `head` and `following` list a cell's spheres."""
    reach = min(1, cells // 2)
    for k in range(len(draw)):
        if placed == len(position):
            break
        cell = np.empty(3, np.int64)
        for axis in range(3):
            cell[axis] = min(int(draw[k, axis] / length * cells), cells - 1)
        free = True
        for dx in range(cell[0] - reach, cell[0] + reach + 1):
            for dy in range(cell[1] - reach, cell[1] + reach + 1):
                for dz in range(cell[2] - reach, cell[2] + reach + 1):
                    number = ((dx % cells) * cells + dy % cells) * cells + dz % cells
                    j = head[number]
                    while free and j >= 0:
                        d2 = 0.0
                        for axis in range(3):
                            x = draw[k, axis] - position[j, axis]
                            x -= length * np.rint(x / length)
                            d2 += x * x
                        free = d2 >= 1.0
                        j = following[j]
        if free:
            position[placed] = draw[k]
            number = (cell[0] * cells + cell[1]) * cells + cell[2]
            following[placed] = head[number]
            head[number] = placed
            placed += 1
    return placed
