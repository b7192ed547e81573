"""Where the particles are when a run starts."""

import numpy as np
from numba import njit

SPHERE_VOLUME = np.pi / 6
"""Volume of a particle, d_p³."""

SATURATION = 0.38
"""Random sequential addition of equal spheres jams near this volume fraction (0.3841)."""

DRAWS_PER_PARTICLE = 10_000
"""Draws after which a packing is given up; at a volume fraction of 0.3 about a hundred suffice."""


def cube_side(particles: int, volume_fraction: float) -> float:
    """Side of the cube that holds `particles` spheres at `volume_fraction`, in d_p.

    L = (n V_p / phi)^(1/3) (paper, section "Mineral dust sedimentation").

    Raises
    ------
    ValueError : fewer than six particles, or a volume fraction outside ]0, 0.38[, where random
        sequential addition jams.
    """
    if particles < 6:
        raise ValueError(f"{particles} particles: at least 6 are needed, for five neighbours each")
    if not 0 < volume_fraction < SATURATION:
        raise ValueError(
            f"volume fraction phi is {volume_fraction}: allowed is 0 < phi < {SATURATION}, where "
            f"random addition without overlap jams"
        )
    return float((particles * SPHERE_VOLUME / volume_fraction) ** (1 / 3))


def random_positions(rng: np.random.Generator, particles: int, volume_fraction: float):
    """Place spheres at random in a periodic cube, one after the other, without overlap.

    Random sequential addition: a draw that overlaps with a sphere already placed is drawn again.

    Returns
    -------
    (n, 3) positions in d_p, within the cube of side `cube_side(particles, volume_fraction)`

    Raises
    ------
    ValueError : as `cube_side`, or the spheres do not fit (phi close to jamming).
    """
    side = cube_side(particles, volume_fraction)
    # Cells no narrower than a diameter, so that overlaps are among the 27 around a draw.
    cells = max(1, min(int(side), int(np.ceil(particles ** (1 / 3)))))
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
        draw = rng.random((particles, 3)) * side
        placed = _add(draw, position, placed, head, following, side, cells)
        draws += particles
    return position


@njit(cache=True)
def _add(draw, position, placed, head, following, side, cells):
    """Add the draws that overlap with nothing; `head` and `following` list a cell's spheres."""
    reach = min(1, cells // 2)
    for k in range(len(draw)):
        if placed == len(position):
            break
        cell = np.empty(3, np.int64)
        for axis in range(3):
            cell[axis] = min(int(draw[k, axis] / side * cells), cells - 1)
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
                            x -= side * np.rint(x / side)
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
