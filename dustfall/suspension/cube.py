"""The periodic cube that a suspension fills."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def folded(position, side):
    """Positions (n, 3) folded into the cube, 0 <= x < side."""
    inside = np.empty_like(position)
    for i in range(len(position)):
        for axis in range(3):
            x = position[i, axis] - side * np.floor(position[i, axis] / side)
            # Rounding puts a coordinate just below a multiple of the side outside the cube.
            inside[i, axis] = x if 0.0 <= x < side else 0.0
    return inside
