"""Stokes drag of an isolated sphere, and of spheres coupled by the Rotne-Prager mobility."""

import numpy as np

from dustfall.forces.frames import check_neighbours, hold_at_contact, sort_by_distance
from dustfall.spheres import checked_positions, flow_direction
from dustfall.suspension.six_spheres import TERMS, six_sphere_forces
from dustfall.units import STOKES_DRAG


class IsolatedStokes:
    """Stokes drag without neighbours: 24 Re_p c_D along the flow."""

    name = "isolated"

    def predict(self, neighbours) -> np.ndarray:
        """Return the force (m, 3) in Re_p c_D for neighbours (m, 5, 3) in d_p.

        Raises ValueError for neighbours of another shape, not finite, or at the centre.
        """
        force = np.zeros((len(check_neighbours(neighbours)), 3))
        force[:, 1] = STOKES_DRAG
        return force


class Stokeslets:
    """Superposed disturbances: the reference sphere in the flow of five isolated neighbours.

    Each neighbour drags the fluid as a point force of Stokes drag: F = 24 (U - sum of
    3/8 (1 + n n)/r . U), first order in 1/r, nothing reflected. Far too low, even negative, where
    several neighbours are close.
    """

    name = "stokeslets"

    def predict(self, neighbours) -> np.ndarray:
        """Return the force (m, 3) in Re_p c_D for neighbours (m, 5, 3) in d_p, any order.

        A neighbour closer than contact is held at contact. Raises ValueError for neighbours of
        another shape, not finite, or at the centre.
        """
        neighbours = hold_at_contact(sort_by_distance(check_neighbours(neighbours)))
        distance = np.linalg.norm(neighbours, axis=2, keepdims=True)
        disturbance = neighbours[:, :, 1:2] * neighbours / distance**3
        disturbance[:, :, 1] += 1 / distance[:, :, 0]
        return STOKES_DRAG * (np.array([0.0, 1.0, 0.0]) - 0.375 * disturbance.sum(axis=1))


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
        return rotne_prager_inverse(hold_at_contact(sort_by_distance(check_neighbours(neighbours))))


def rotne_prager_inverse(neighbours: np.ndarray) -> np.ndarray:
    """Force (m, 3) of sorted neighbours (m, 5, 3) that are no closer than contact."""
    return six_sphere_forces(neighbours, 0, np.zeros((2, TERMS)))


def rotne_prager_forces(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Return the forces on any number of fixed spheres from the inverted Rotne-Prager mobility.

    Parameters: `centres` (n, 3) in d_p; `flow` (3,), the uniform flow, whose magnitude makes forces
    dimensionless. Returns (n, 3) in Re_p c_D (an isolated sphere: 24 along the flow).
    Overlapping pairs take Yamakawa's (1970) extension, which keeps the mobility positive definite.

    Raises ValueError for another shape, a value that is not finite, or coincident centres.
    """
    centres, flow = checked_positions(centres), flow_direction(flow)
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
