"""The inverted Rotne-Prager mobility of the reference sphere and its neighbours."""

import numpy as np

from dustfall.forces.formula import Formula
from dustfall.suspension.few_spheres import NO_CORRECTION, forces_among_neighbours


def rotne_prager_inverse(neighbours: np.ndarray) -> np.ndarray:
    """All spheres fixed in a uniform flow along +y: (m, k, 3) to (m, 3).

    The mobility (Rotne & Prager 1969; for overlapping neighbours the extension of Yamakawa 1970)
    couples translations and forces up to (radius / distance)^3; it has no lubrication. Far away
    the force goes over into Stokes drag as 1/distance.
    """
    return forces_among_neighbours(neighbours, 0, NO_CORRECTION)


MODEL = Formula("rotne_prager", "Rotne–Prager inverse", rotne_prager_inverse)
