"""Forces by reflected dipoles: what the Rotne-Prager mobility leaves out, without training."""

from functools import cache

import numpy as np

from dustfall.forces.formula import Formula
from dustfall.stokes.references.exact_pairs import pair_drag
from dustfall.suspension.few_spheres import NO_CORRECTION, POWER, TERMS, forces_among_neighbours
from dustfall.units import STOKES_DRAG

REFLECTIONS = 2
"""With the exact pair on top, a third reflection changes forces by less than what is left out."""

POINTS_A_TERM = 6
"""Chebyshev points for each coefficient of a polynomial: fitted, not interpolated."""


def reflected_forces(neighbours: np.ndarray) -> np.ndarray:
    """Rotne-Prager forces, the dipoles that they induce reflected twice, and every pair exact.

    A held sphere resists strain and rotation: the flow of the others induces a stresslet and a
    torque on it, whose flow changes the forces (method of reflections; Kim & Karrila 1991). With M
    the Rotne-Prager mobility, K the gradients at all centres that forces cause, and L the
    response of a sphere, the forces solve (M - K^T L K) F = U up to couplings between dipoles;
    here F = sum over n = 0 ... REFLECTIONS of (M^-1 K^T L K)^n M^-1 U.

    What then is missing in a pair is added from the exact solution for two spheres, in the flow
    that the others cause at the pair: the pair as Stokesian dynamics corrects it (Durlofsky,
    Brady & Bossis 1987), but screened. Two spheres alone have the exact force. Far away the force
    goes over into Stokes drag as 1/distance.

    neighbours: (m, k, 3) [d_p], nearest first, no closer than contact. Returns (m, 3) [Re_p c_D].
    """
    return forces_among_neighbours(neighbours, REFLECTIONS, pair_correction())


@cache
def pair_correction() -> np.ndarray:
    """Polynomials (2, TERMS) in d_p / distance: what the reflections leave out of a pair.

    Highest power first; times (d_p / distance)^POWER they are the exact force of two spheres minus
    the reflected one, over the isolated drag, for flow along and across the line of centres. Fitted
    by least squares at Chebyshev points of d_p / distance.
    """
    number = POINTS_A_TERM * TERMS
    inverse = 0.5 + 0.5 * np.cos(np.pi * (np.arange(number) + 0.5) / number)
    correction = np.empty((2, TERMS))
    for row, axis, exact in zip(correction, (1, 0), pair_drag(1 / inverse), strict=True):
        neighbours = (np.eye(3)[axis] / inverse[:, None])[:, None]
        reflected = forces_among_neighbours(neighbours, REFLECTIONS, NO_CORRECTION)[:, 1]
        missing = exact - reflected / STOKES_DRAG
        powers = inverse[:, None] ** (POWER + np.arange(TERMS)[::-1])
        row[:] = np.linalg.lstsq(powers, missing, rcond=None)[0]
    return correction


MODEL = Formula("reflections", "reflected dipoles", reflected_forces)
