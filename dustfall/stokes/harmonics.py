"""Real spherical harmonics, orthonormal on the unit sphere."""

import numpy as np
from scipy.special import sph_harm_y_all


def real_harmonics(degree: int, directions) -> np.ndarray:
    """Values of all harmonics up to `degree` at unit vectors.

    directions: (n, 3). Returns (n, (degree + 1)^2); column l^2 + l + m holds degree l, order m,
    sine for m < 0 and cosine for m > 0.
    """
    directions = np.asarray(directions, dtype=float)
    polar = np.arccos(np.clip(directions[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    complex_values = sph_harm_y_all(degree, degree, polar, azimuth)
    out = np.empty((len(directions), (degree + 1) ** 2))
    for l in range(degree + 1):  # noqa: E741 - the field's letter
        middle = l * l + l
        out[:, middle] = complex_values[l, 0].real
        for m in range(1, l + 1):
            sign = np.sqrt(2.0) * (-1.0) ** m
            out[:, middle + m] = sign * complex_values[l, m].real
            out[:, middle - m] = sign * complex_values[l, m].imag
    return out
