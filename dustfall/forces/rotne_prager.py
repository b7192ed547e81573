"""Stokes drag of an isolated sphere, and of spheres coupled by the Rotne-Prager mobility."""

import numpy as np
from numba import njit

from dustfall import STOKES_DRAG
from dustfall.forces.frames import NEIGHBOURS, check_neighbours, hold_at_contact, sort_by_distance

LANES = 64  # scenes that one pass of a kernel carries side by side, a whole vector of numbers each
_SIZE = 3 * (NEIGHBOURS + 1)


class IsolatedStokes:
    """Stokes drag without neighbours: 24 Re_p c_D along the flow."""

    name = "stokes"

    def predict(self, neighbours) -> np.ndarray:
        """Return the force (m, 3) in Re_p c_D for neighbours (m, 5, 3) in d_p.

        Raises ValueError for neighbours of another shape, not finite, or at the centre.
        """
        force = np.zeros((len(check_neighbours(neighbours)), 3))
        force[:, 1] = STOKES_DRAG
        return force


class RotnePrager:
    """Force from the inverted Rotne-Prager mobility of the reference sphere and five neighbours.

    All six spheres are fixed in a uniform flow along +y. The mobility (Rotne & Prager 1969;
    for overlapping neighbours the extension of Yamakawa 1970) couples translations and forces up to
    (radius / distance)^3; it has no lubrication. A neighbour closer to the reference sphere than
    contact is held at contact. Far away the force goes over into Stokes drag as 1/distance.
    """

    name = "rotne_prager"

    def predict(self, neighbours) -> np.ndarray:
        """Return the force (m, 3) in Re_p c_D for neighbours (m, 5, 3) in d_p, any order.

        Raises ValueError for neighbours of another shape, not finite, or at the centre.
        """
        return six_sphere_forces(hold_at_contact(sort_by_distance(check_neighbours(neighbours))))


def rotne_prager_forces(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Return the forces on any number of fixed spheres from the inverted Rotne-Prager mobility.

    Parameters: `centres` (n, 3) in d_p; `flow` (3,), the uniform flow in units of the relative
    velocity that defines Re_p. Returns (n, 3) in Re_p c_D (an isolated sphere: 24 along the flow).
    Overlapping pairs take Yamakawa's (1970) extension, which keeps the mobility positive definite.

    Raises ValueError for another shape, a value that is not finite, or coincident centres.
    """
    centres = np.asarray(centres, dtype=float)
    flow = np.asarray(flow, dtype=float)
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise ValueError(f"centres have shape {centres.shape}; they must be (n, 3) with n >= 1")
    if flow.shape != (3,):
        raise ValueError(f"flow has shape {flow.shape}; it must be (3,)")
    if not (np.isfinite(centres).all() and np.isfinite(flow).all()):
        raise ValueError("centres and flow must be finite")
    n = len(centres)
    separation = centres[:, None] - centres[None]
    distance = np.linalg.norm(separation, axis=2)
    first, second = np.nonzero(np.triu(distance == 0.0, 1))
    if len(first):
        raise ValueError(f"spheres {first[0]} and {second[0]} have the same centre")
    distance[np.diag_indices(n)] = 1.0
    across, along = _pair_mobility(distance)
    direction = separation / distance[:, :, None]
    mobility = across[:, :, None, None] * np.eye(3)
    mobility += along[:, :, None, None] * direction[..., :, None] * direction[..., None, :]
    mobility[np.diag_indices(n)] = np.eye(3)
    mobility = mobility.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    return STOKES_DRAG * np.linalg.solve(mobility, np.tile(flow, n)).reshape(n, 3)


def _pair_mobility(distance):
    """Coefficients of 1 and of the dyad r r / |r|^2, in units of the isolated sphere's mobility."""
    square = distance**2
    far = distance > 1.0
    across = np.where(far, 0.375 / distance * (1 + 1 / (6 * square)), 1 - 0.5625 * distance)
    along = np.where(far, 0.375 / distance * (1 - 1 / (2 * square)), 0.1875 * distance)
    return across, along


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def six_sphere_forces(neighbours):
    """Force (m, 3) on the reference sphere of scenes (m, 5, 3), see `RotnePrager`.

    Cholesky factorisation of the 18x18 mobility with the reference sphere last, so that the back
    substitution ends after three unknowns. The last index of every array runs over LANES
    scenes, which the compiler turns into vector instructions.
    """
    count = neighbours.shape[0]
    force = np.empty((count, 3))
    centre = np.empty((NEIGHBOURS + 1, 3, LANES))
    # The last row carries the flow: the factorisation then does the forward substitution as well.
    factor = np.empty((_SIZE + 1, _SIZE, LANES))
    solution = np.empty((3, LANES))
    for start in range(0, count, LANES):
        for lane in range(LANES):
            m = min(start + lane, count - 1)
            for k in range(3):
                for j in range(NEIGHBOURS):
                    centre[j, k, lane] = neighbours[m, j, k]
                centre[NEIGHBOURS, k, lane] = 0.0
        for i in range(NEIGHBOURS + 1):
            for k in range(3):
                for lane in range(LANES):
                    factor[_SIZE, 3 * i + k, lane] = 1.0 if k == 1 else 0.0
                for j in range(3):
                    for lane in range(LANES):
                        factor[3 * i + k, 3 * i + j, lane] = 1.0 if k == j else 0.0
            for j in range(i):
                _pair_block(factor, centre, i, j)
        for j in range(_SIZE):
            for i in range(j, _SIZE + 1):
                for k in range(j):
                    for lane in range(LANES):
                        factor[i, j, lane] -= factor[i, k, lane] * factor[j, k, lane]
                if i == j:
                    for lane in range(LANES):
                        factor[j, j, lane] = 1.0 / np.sqrt(factor[j, j, lane])
                else:
                    for lane in range(LANES):
                        factor[i, j, lane] *= factor[j, j, lane]
        for k in range(2, -1, -1):
            row = _SIZE - 3 + k
            for lane in range(LANES):
                solution[k, lane] = factor[_SIZE, row, lane]
            for j in range(k + 1, 3):
                for lane in range(LANES):
                    solution[k, lane] -= factor[_SIZE - 3 + j, row, lane] * solution[j, lane]
            for lane in range(LANES):
                solution[k, lane] *= factor[row, row, lane]
        for lane in range(min(LANES, count - start)):
            for k in range(3):
                force[start + lane, k] = STOKES_DRAG * solution[k, lane]
    return force


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _pair_block(factor, centre, i, j):
    for lane in range(LANES):
        x = centre[i, 0, lane] - centre[j, 0, lane]
        y = centre[i, 1, lane] - centre[j, 1, lane]
        z = centre[i, 2, lane] - centre[j, 2, lane]
        # The floor keeps the mobility of two coincident neighbours positive definite.
        square = max(x * x + y * y + z * z, 1e-12)
        distance = np.sqrt(square)
        if square > 1.0:
            across = 0.375 / distance * (1 + 1 / (6 * square))
            along = 0.375 / (distance * square) * (1 - 1 / (2 * square))
        else:
            across = 1 - 0.5625 * distance
            along = 0.1875 / distance
        factor[3 * i, 3 * j, lane] = across + along * x * x
        factor[3 * i + 1, 3 * j + 1, lane] = across + along * y * y
        factor[3 * i + 2, 3 * j + 2, lane] = across + along * z * z
        factor[3 * i, 3 * j + 1, lane] = factor[3 * i + 1, 3 * j, lane] = along * x * y
        factor[3 * i, 3 * j + 2, lane] = factor[3 * i + 2, 3 * j, lane] = along * x * z
        factor[3 * i + 1, 3 * j + 2, lane] = factor[3 * i + 2, 3 * j + 1, lane] = along * y * z
