"""Forces by reflected dipoles: what the Rotne-Prager mobility leaves out, without training."""

from functools import cache

import numpy as np

from dustfall.forces.frames import NEIGHBOURS, check_neighbours, hold_at_contact, sort_by_distance
from dustfall.stokes.references.exact_pairs import pair_drag
from dustfall.suspension.six_spheres import POWER, TERMS, six_sphere_forces
from dustfall.units import STOKES_DRAG

REFLECTIONS = 2


class Reflections:
    """Rotne-Prager forces, the dipoles that they induce reflected twice, and every pair exact.

    A held sphere resists strain and rotation: the flow of the other five induces a stresslet and a
    torque on it, whose flow changes the forces (method of reflections; Kim & Karrila 1991). With M
    the Rotne-Prager mobility, K the gradients at all centres that forces cause, and L the
    response of a sphere, the forces solve (M - K^T L K) F = U up to couplings between dipoles;
    here F = sum over n = 0 ... REFLECTIONS of (M^-1 K^T L K)^n M^-1 U.

    What then is missing in a pair is added from the exact solution for two spheres, in the flow
    that the other four cause at the pair: the pair as Stokesian dynamics corrects it (Durlofsky,
    Brady & Bossis 1987), but screened. Two spheres alone have the exact force.
    """

    name = "reflections"

    def predict(self, neighbours) -> np.ndarray:
        """Return the force (m, 3) in Re_p c_D for neighbours (m, 5, 3) in d_p, any order.

        A neighbour closer to the reference sphere than contact is held at contact. Far away the
        force goes over into Stokes drag as 1/distance. Raises ValueError for neighbours of another
        shape, not finite, or at the centre.
        """
        return reflected_forces(hold_at_contact(sort_by_distance(check_neighbours(neighbours))))


def reflected_forces(neighbours: np.ndarray) -> np.ndarray:
    """Force (m, 3) of sorted neighbours (m, 5, 3) that are no closer than contact."""
    return six_sphere_forces(neighbours, REFLECTIONS, pair_correction())


@cache
def pair_correction() -> np.ndarray:
    """Polynomials (2, TERMS) in d_p / distance: what the reflections leave out of a pair.

    Highest power first; times (d_p / distance)^POWER they are the exact force of two spheres minus
    the reflected one, over the isolated drag, for flow along and across the line of centres. Fitted
    by least squares at Chebyshev points of d_p / distance.
    """
    number = 6 * TERMS
    inverse = 0.5 + 0.5 * np.cos(np.pi * (np.arange(number) + 0.5) / number)
    correction = np.empty((2, TERMS))
    for row, axis, exact in zip(correction, (1, 0), pair_drag(1 / inverse), strict=True):
        # The reference sphere and one neighbour, the other four out of reach.
        neighbours = 1e9 * np.random.default_rng(0).normal(size=(number, NEIGHBOURS, 3))
        neighbours[:, 0] = np.eye(3)[axis] / inverse[:, None]
        reflected = six_sphere_forces(neighbours, REFLECTIONS, np.zeros((2, TERMS)))[:, 1]
        missing = exact - reflected / STOKES_DRAG
        powers = inverse[:, None] ** (POWER + np.arange(TERMS)[::-1])
        row[:] = np.linalg.lstsq(powers, missing, rcond=None)[0]
    return correction
