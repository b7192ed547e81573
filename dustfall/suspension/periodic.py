"""Mobility of all spheres of a periodic suspension, coupled by the Rotne-Prager tensor."""

import numpy as np
from scipy.special import erfc

from dustfall.spheres import checked_positions
from dustfall.suspension.rotne_prager import pair_coefficients
from dustfall.units import CONTACT, RADIUS

HASIMOTO = 2.837297
"""Images slow a sphere in a periodic cube of side L by this times radius / L (Hasimoto 1959)."""

CLOSEST = 0.01
"""Distance of two centres [d_p] below which Beenakker's sum loses digits to (radius / r)^3."""


def periodic_mobility(positions, side: float, tolerance=1e-5, splitting=None) -> np.ndarray:
    """Mobility (3n, 3n) of n spheres and all their images in a periodic cube, by Ewald summation.

    Rotne-Prager tensor, in units of an isolated sphere's mobility (Beenakker 1986, J. Chem. Phys.
    85, 1581). The term of wavenumber zero is left out: spheres and fluid together have no net
    flux, which is how a suspension settles in a vessel with a bottom. The matrix is symmetric and
    positive definite, also where spheres overlap (`pair_coefficients`).

    Parameters
    ----------
    positions : (n, 3) in d_p, wrapped or not
    side : of the cube, d_p
    tolerance : about the error of an entry
    splitting : inverse length [1/d_p] that shares the work between the two sums; changes nothing
        but run time

    Raises
    ------
    ValueError : positions of another shape, or two centres closer than `CLOSEST`.
    """
    positions = checked_positions(positions)
    n = len(positions)
    reach = np.sqrt(-np.log(tolerance)) + 0.5
    # The real sum needs the nearest image alone when its terms have died out at half the side.
    xi = 2 * reach / side if splitting is None else splitting
    # Overlapping spheres have terms of their own, of any image.
    images = int(np.ceil(max(reach / xi, CONTACT) / side - 0.5))
    mobility = np.zeros((3, 3, n, n))
    separation = positions[:, None] - positions[None]
    separation -= side * np.rint(separation / side)
    closest = np.linalg.norm(separation, axis=2) + side * np.eye(n)
    if closest.min() < CLOSEST:
        i, j = np.unravel_index(closest.argmin(), closest.shape)
        raise ValueError(
            f"the centres of spheres {i} and {j} are {closest[i, j]} d_p apart: {CLOSEST} is needed"
        )
    shifts = range(-images, images + 1)
    for shift in ((i, j, k) for i in shifts for j in shifts for k in shifts):
        _add_real(mobility, separation + side * np.array(shift), xi, itself=shift == (0, 0, 0))
    _add_reciprocal(mobility, positions, side, xi, reach)
    x = xi * RADIUS
    of_itself = 1 - 6 / np.sqrt(np.pi) * x + 40 / (3 * np.sqrt(np.pi)) * x**3
    for axis in range(3):
        mobility[axis, axis, np.arange(n), np.arange(n)] += of_itself
    return mobility.transpose(2, 0, 3, 1).reshape(3 * n, 3 * n)


def _add_real(mobility, separation, xi, itself):
    """Beenakker's M^(1), the part that dies out with the distance; overlapping pairs corrected."""
    a = RADIUS
    r = np.linalg.norm(separation, axis=2)
    if itself:
        np.fill_diagonal(r, np.inf)
    far = erfc(xi * r)
    with np.errstate(invalid="ignore"):
        near = np.where(np.isfinite(r), np.exp(-((xi * r) ** 2)) / np.sqrt(np.pi), 0.0)
        r2 = np.where(np.isfinite(r), r**2, 1.0)
    across = (0.75 * a / r + 0.5 * (a / r) ** 3) * far + near * (
        4 * xi**7 * a**3 * r2**2
        + 3 * xi**3 * a * r2
        - 20 * xi**5 * a**3 * r2
        - 4.5 * xi * a
        + 14 * xi**3 * a**3
        + xi * a**3 / r2
    )
    along = (0.75 * a / r - 1.5 * (a / r) ** 3) * far + near * (
        -4 * xi**7 * a**3 * r2**2
        - 3 * xi**3 * a * r2
        + 16 * xi**5 * a**3 * r2
        + 1.5 * xi * a
        - 2 * xi**3 * a**3
        - 3 * xi * a**3 / r2
    )
    overlapping = r < CONTACT
    near = [pair_coefficients(distance) for distance in r[overlapping]]
    near_across, near_along = np.array(near).reshape(-1, 2).T
    q = a / r[overlapping]
    across[overlapping] += near_across - (0.75 * q + 0.5 * q**3)
    along[overlapping] += near_along - (0.75 * q - 1.5 * q**3)
    direction = separation / np.sqrt(r2)[:, :, None]
    for p in range(3):
        mobility[p, p] += across
        for q in range(3):
            mobility[p, q] += along * direction[:, :, p] * direction[:, :, q]


def _add_reciprocal(mobility, positions, side, xi, reach):
    """Beenakker's M^(2), the smooth part, as a product of waves at the two spheres."""
    a = RADIUS
    highest = int(np.ceil(2 * xi * reach * side / (2 * np.pi)))
    axis = np.arange(-highest, highest + 1)
    index = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    # Of a wave and its opposite one is enough, counted twice.
    index = index[len(index) // 2 + 1 :]
    index = index[(index**2).sum(axis=1) <= highest**2]
    k = 2 * np.pi / side * index
    k2 = (k**2).sum(axis=1)
    q = k2 / (4 * xi**2)
    weight = (a - a**3 * k2 / 3) * (1 + q + 2 * q**2) * 6 * np.pi / k2 * np.exp(-q)
    weight *= 2 / side**3
    phase = positions @ k.T
    wave = np.hstack([np.cos(phase), np.sin(phase)])
    for p in range(3):
        for r in range(p, 3):
            transverse = weight * ((p == r) - k[:, p] * k[:, r] / k2)
            block = (wave * np.tile(transverse, 2)) @ wave.T
            mobility[p, r] += block
            if r != p:
                mobility[r, p] += block
