"""Superposed disturbances: the reference sphere in the flow of its neighbours as if isolated."""

import numpy as np

from dustfall.forces.formula import Formula
from dustfall.units import STOKES_DRAG


def superposed_stokeslets(neighbours: np.ndarray) -> np.ndarray:
    """Each neighbour drags the fluid as a point force of Stokes drag: (m, k, 3) to (m, 3).

    F = 24 (U - sum of 3/8 (1 + n n)/r . U), first order in 1/r, nothing reflected. Far too low,
    even negative, where several neighbours are close.
    """
    distance = np.linalg.norm(neighbours, axis=2, keepdims=True)
    disturbance = neighbours[:, :, 1:2] * neighbours / distance**3
    disturbance[:, :, 1] += 1 / distance[:, :, 0]
    return STOKES_DRAG * (np.array([0.0, 1.0, 0.0]) - 0.375 * disturbance.sum(axis=1))


MODEL = Formula("stokeslets", "superposed Stokeslets", superposed_stokeslets, settles=False)
