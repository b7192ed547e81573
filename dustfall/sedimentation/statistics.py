"""What the series of a run holds of each step."""

import numpy as np
from numba import njit

from dustfall.forces.frames import NEIGHBOURS

LAST = NEIGHBOURS - 1


def step_statistics(
    velocity: np.ndarray,
    beta: np.ndarray,
    side_force: np.ndarray,
    neighbours,
    index_before: np.ndarray,
) -> dict:
    """Averages over particles, and counts, at one step.

    Parameters
    ----------
    velocity : (n, 3) in v_s
    beta, side_force : (n,) and (n, 3) as from `dynamics.drag_coefficients`
    neighbours : `NeighbourList` at this step
    index_before : (n, 5) rows of the neighbours a step ago, nearest first

    Returns
    -------
    fields of the series, see `trajectory.SERIES_MEANING`
    """
    falling = -velocity[:, 2]
    fresh, fifth_alone = changed_neighbours(neighbours.index, index_before)
    overlaps, below_contact = contacts(
        neighbours.vectors(neighbours.order), neighbours.order, neighbours.index
    )
    return {
        "settling_velocity_mean": falling.mean(),
        "settling_velocity_variance": falling.var(),
        "inverse_beta_mean": (1 / beta).mean(),
        "beta_mean": beta.mean(),
        "drag_mean": (side_force[:, 2] + beta * falling).mean(),
        "new_neighbours": fresh / len(velocity),
        "only_fifth": fifth_alone / fresh if fresh else np.nan,
        "overlaps": overlaps,
        "below_contact": below_contact,
    }


@njit(cache=True, nogil=True)
def changed_neighbours(index, before):
    """Count particles whose set of five is another than before.

    Returns their number, and the number of those among them that only the fifth changed of: the
    one that left was the fifth before, and the one that came is the fifth now.
    """
    fresh = fifth_alone = 0
    for i in range(len(index)):
        came = 0
        for slot in range(NEIGHBOURS):
            came += not _is_among(index[i, slot], before, i)
        fresh += came > 0
        fifth_alone += (
            came == 1
            and not _is_among(index[i, LAST], before, i)
            and not _is_among(before[i, LAST], index, i)
        )
    return fresh, fifth_alone


@njit(cache=True, nogil=True)
def _is_among(j, index, i):
    """Whether `j` is one of the five of particle `i`."""
    found = False
    for slot in range(NEIGHBOURS):
        found |= index[i, slot] == j
    return found


@njit(cache=True, nogil=True)
def contacts(vectors, rows, index):
    """Count what is closer than a diameter, centre to centre.

    `vectors` (n, 5, 3) from the particles `rows` (n,), all of them in any order, to their
    neighbours; `index` (n, 5) as of `NeighbourList`.

    Returns the pairs of particles of which one is among the other's five nearest, and the
    neighbours that the force model sees below contact (of one pair: one or two).
    """
    pairs = seen = 0
    for k in range(len(rows)):
        i = rows[k]
        for slot in range(NEIGHBOURS):
            x, y, z = vectors[k, slot, 0], vectors[k, slot, 1], vectors[k, slot, 2]
            if x * x + y * y + z * z < 1.0:
                seen += 1
                j = index[i, slot]
                pairs += i < j or not _is_among(i, index, j)
    return pairs, seen
