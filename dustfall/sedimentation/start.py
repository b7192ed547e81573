"""Where the particles are when a run starts, and how fast."""

import os
import warnings
from pathlib import Path

import numpy as np
import scipy
from numba import njit

from dustfall.sedimentation.neighbours import FARTHEST, sort_by_cell
from dustfall.sedimentation.state import State, box_length
from dustfall.sedimentation.trajectory import open_run
from dustfall.spheres import TOUCH, checked_numbers, plain
from dustfall.streams import Purpose, stream
from dustfall.suspension.cube import folded
from dustfall.tables import SUFFIXES, Quantity, read_table
from dustfall.units import CONTACT

SATURATION = 0.38
"""Random sequential addition of equal spheres jams near this volume fraction (0.3841)."""

DRAWS_PER_PARTICLE = 10_000
"""Draws after which a packing is given up; at a volume fraction of 0.3 about a hundred suffice."""


FASTEST = 100.0
"""Largest component of a velocity at the start [v_s]: no cloud's particle settles so fast."""

LONGEST_LINE = 1000
"""Bytes that a line of a table has at most, on average."""

MOST_IN_A_CELL = 8
"""Centres of spheres that do not overlap find place in a cube of side d_p: one in each corner."""

START_VELOCITY = {"rest": 0.0, "stokes": -1.0}
"""Vertical velocity at the start [v_s]."""

START_TABLE = {
    "position": Quantity((3,), "d_p", "unwrapped positions, z upwards"),
    "velocity": Quantity((3,), "v_s", "velocities, z upwards", required=False),
}
"""What a table holds that a run starts from."""


def random_start(
    particles: int, volume_fraction: float, seed: int, case: int = 0, velocity: str = "rest"
) -> State:
    """Spheres at random places without overlap, all at rest or at the Stokes velocity.

    The places depend on (seed, case) alone. Raises ValueError as `random_positions` and
    `start_from` do.
    """
    draws, volume_fraction = stream(Purpose.START, seed, case), plain(volume_fraction)
    return start_from(
        random_positions(draws, particles, volume_fraction), volume_fraction, velocity
    )


def start_from(position, volume_fraction: float, velocity="rest") -> State:
    """Start from given places (n, 3) [d_p] and velocities: (n, 3) [v_s], "rest" or "stokes".

    Raises ValueError for another shape, a value that is missing, not finite or too large, or
    another word.
    """
    position, volume_fraction = checked_numbers("positions", position), plain(volume_fraction)
    if position.ndim == 0:
        raise ValueError("positions are one number: (n, 3) are needed")
    number = len(position)
    if isinstance(velocity, str):
        if velocity not in START_VELOCITY:
            raise ValueError(f"start is {velocity!r}: allowed are {', '.join(START_VELOCITY)}")
        velocity = np.tile([0.0, 0.0, START_VELOCITY[velocity]], (number, 1))
    velocity = checked_numbers("velocities", velocity)
    farthest = FARTHEST * box_length(number, volume_fraction)
    for name, array, most, unit in (
        ("positions", position, farthest, "d_p"),
        ("velocities", velocity, FASTEST, "v_s"),
    ):
        if array.shape != (number, 3):
            raise ValueError(f"{name} have shape {array.shape}: ({number}, 3) is needed")
        bad = np.flatnonzero(~(np.abs(array) <= most).all(axis=1))
        if len(bad):
            raise ValueError(
                f"{name} at the start hold {array[bad[0]].tolist()} for particle {bad[0]}: allowed "
                f"are finite values of at most {most:.3g} {unit}"
            )
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


def read_start(path: str | Path, particles: int | None, volume_fraction: float):
    """Read where a run starts: the last frame of a trajectory (.nc), or a table.

    A trajectory follows the AMBER convention, as those of this package do, with coordinates in d_p
    and, where it has them, velocities in v_s; its cube is the one that `particles` and
    `volume_fraction` give; as many particles as there are, if `particles` is None. A table (csv,
    txt, npy, h5, see `dustfall.tables`) has x, y, z in d_p and, if any, velocity_x, velocity_y,
    velocity_z in v_s. Any other file is text, one particle a line: x y z, or x y z v_x v_y v_z, as
    a table of text without names; what follows a # is a comment. Spheres of a table may not
    overlap; those of a run have moved as its closure said, which may be into each other.

    Returns
    -------
    positions (n, 3) in d_p, and velocities (n, 3) in v_s or None

    Raises
    ------
    FileNotFoundError : there is no such file.
    ValueError : the file is damaged or holds something else, another number of particles, another
        cube, values that are missing or too large, spheres that overlap.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        raise ValueError(f"{path} is no file: a trajectory (.nc) or a table of text is needed")
    if path.suffix == ".nc":
        positions, velocities = _last_frames(path, particles, volume_fraction)
    elif path.suffix in SUFFIXES:
        if path.suffix == ".txt":
            _check_size(path, particles)
        columns = read_table(path, START_TABLE)
        positions, velocities = columns["position"], columns.get("velocity")
    else:
        table = _table(path, particles)
        positions, velocities = table[:, :3], table[:, 3:] if table.shape[1] == 6 else None
    if particles not in (None, len(positions)):
        raise ValueError(f"{path} holds {len(positions)} particles: {particles} are needed")
    try:
        start_from(positions, volume_fraction, "rest" if velocities is None else velocities)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if path.suffix != ".nc":
        _refuse_overlaps(path, positions, box_length(len(positions), volume_fraction))
    return positions, velocities


def _check_size(path: Path, particles: int | None) -> None:
    """Raise ValueError for more text than so many particles need, if their number is known."""
    with open(path, "rb") as file:
        size = file.seek(0, os.SEEK_END)
    if particles is not None and size > LONGEST_LINE * (particles + 100):
        raise ValueError(
            f"{path} has {size} bytes: a table of {particles} particles has at most "
            f"{LONGEST_LINE} a line"
        )


def _table(path: Path, particles: int | None) -> np.ndarray:
    """A table of 3 or 6 columns."""
    _check_size(path, particles)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an empty file
            table = np.loadtxt(path, ndmin=2, encoding="utf-8")
    except ValueError as error:
        words = str(error).split("; use `usecols`")[0]
        raise ValueError(f"{path} is no table of numbers: {words}") from None
    if table.size == 0:
        raise ValueError(f"{path} holds no particle: {particles or 'some'} are needed")
    if table.shape[1] not in (3, 6):
        raise ValueError(
            f"{path} has {table.shape[1]} columns: 3 or 6 are needed, x y z [v_x v_y v_z]"
        )
    return table


def _last_frames(path: Path, particles: int | None, volume_fraction: float):
    """Positions, and velocities or None, of the last frame of a trajectory in float64."""
    with open_run(path) as file:
        if particles is None:
            if "atom" not in file.dimensions:
                raise ValueError(f"{path} has no dimension atom: it is no trajectory")
            particles = file.dimensions["atom"].size
        length = box_length(particles, volume_fraction)
        lengths = _last_frame(path, file, "cell_lengths", "d_p", (3,))
        if lengths is not None and not np.allclose(lengths, length, rtol=1e-6):
            raise ValueError(
                f"{path} has a cell of {lengths} d_p: {particles} particles at volume fraction "
                f"phi = {volume_fraction:g} fill a cube of {length:.6g} d_p"
            )
        positions = _last_frame(path, file, "coordinates", "d_p", (particles, 3))
        velocities = _last_frame(path, file, "velocities", "v_s", (particles, 3))
    if positions is None:
        raise ValueError(f"{path} has no variable coordinates")
    return positions, velocities


def _last_frame(path, file, name, units, shape):
    """Last frame of a variable in float64; None where there is no such variable."""
    if name not in file.variables:
        return None
    variable = file[name]
    found = getattr(variable, "units", units)
    if variable.ndim == 0 or found != units or len(variable) == 0:
        raise ValueError(
            f"{path} has {len(variable) if variable.ndim else 0} frames of {name} in {found}: "
            f"{units} needed"
        )
    if variable.shape[1:] != shape:
        if name == "coordinates" and variable.shape[2:] == (3,):
            raise ValueError(f"{path} holds {variable.shape[1]} particles: {shape[0]} are needed")
        raise ValueError(f"{path} has {name} of shape {variable.shape[1:]}: {shape} is needed")
    variable.set_auto_mask(True)
    try:
        return checked_numbers(f"{name} of the last frame", variable[-1])
    except (OSError, RuntimeError, ValueError) as error:
        raise ValueError(f"{path} cannot be read: {error}") from error


def _refuse_overlaps(path: Path, position: np.ndarray, length: float) -> None:
    """Raise ValueError that names the two particles whose spheres overlap most."""
    wrapped = folded(position, length)
    extent = np.ptp(position, axis=0).max()
    hint = "; in units of a diameter: these look like metres" if extent < 1.0 else ""
    if len(position) < 2:
        return
    # Cells first: a tree of points that lie all in one place takes for ever.
    _, cell, count = np.unique(np.floor(wrapped), axis=0, return_inverse=True, return_counts=True)
    if count.max() > MOST_IN_A_CELL:
        rows = np.flatnonzero(cell.ravel() == count.argmax())[: MOST_IN_A_CELL + 1]
        distance, nearest = scipy.spatial.cKDTree(wrapped[rows]).query(wrapped[rows], k=2)
        nearest = rows[nearest]
    else:
        rows = np.arange(len(position))
        distance, nearest = scipy.spatial.cKDTree(wrapped, boxsize=length).query(wrapped, k=2)
    closest = distance[:, 1].argmin()
    if distance[closest, 1] < CONTACT - TOUCH:
        # Of points in one place the tree lists any first.
        own = rows[closest]
        i, j = sorted((int(own), int(nearest[closest][nearest[closest] != own][-1])))
        raise ValueError(
            f"{path}: particles {i} and {j} (counted from 0) overlap, their centres are "
            f"{distance[closest, 1]:.3g} d_p apart: at least {CONTACT:g} is needed{hint}"
        )


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
