"""Stokes drag without neighbours."""

import numpy as np

from dustfall.forces.formula import Formula
from dustfall.units import STOKES_DRAG


def stokes_drag(neighbours: np.ndarray) -> np.ndarray:
    """24 Re_p c_D along the flow for each scene: (m, k, 3) to (m, 3)."""
    force = np.zeros((len(neighbours), 3))
    force[:, 1] = STOKES_DRAG
    return force


MODEL = Formula("isolated", "Stokes drag", stokes_drag)
