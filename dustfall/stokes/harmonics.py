"""Real spherical harmonics, and the single-layer operator of a sphere written in them.

A vector field on a sphere has Cartesian components, each a sum of harmonics: coefficients (k, 3),
k = (degree + 1)^2. The single layer of Stokes flow commutes with rotations and does not mix
degrees, so within a degree n it is a number on each of the three subspaces of total angular
momentum J = n - 1, n, n + 1 (the Cartesian components of the vector harmonics V, X, W of Corona
and Veerapaneni 2018).
"""

from functools import cache

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.sparse import block_diag, csr_array, eye_array, kron
from scipy.special import sph_harm_y_all


def real_harmonics(degree: int, directions) -> np.ndarray:
    """Values of all harmonics up to `degree` at unit vectors, orthonormal on the unit sphere.

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


@cache
def axes_swapped(degree: int) -> csr_array:
    """Matrix that takes harmonics of f(x, y, z) to those of f(x, z, y); symmetric, its own inverse.

    A rotation about y is this, a rotation about z, and this again (Pinchon and Hoggan 2007), and
    a rotation about z only turns the pair (cosine, sine) of each order.
    """
    # Where a product is even in x, y and z an octant is enough; all others integrate to nothing.
    half = degree // 2 + 1
    z, along_z = leggauss(2 * half)
    z, along_z = z[half:], along_z[half:]
    azimuth = (np.arange(half) + 0.5) * np.pi / (2 * half)
    across = np.sqrt(1.0 - z**2)
    x = np.outer(across, np.cos(azimuth)).ravel()
    y = np.outer(across, np.sin(azimuth)).ravel()
    points = np.column_stack([x, y, np.repeat(z, half)])
    weights = np.repeat(along_z, half) * 4.0 * np.pi / half
    plain = real_harmonics(degree, points) * weights[:, None]
    swapped = real_harmonics(degree, points[:, [0, 2, 1]])
    blocks = []
    for n in range(degree + 1):
        m = np.arange(-n, n + 1)
        odd_y, odd_z = m < 0, (n + m) % 2 == 1
        kept = (odd_y[:, None] == odd_z) & (odd_z[:, None] == odd_y)
        blocks.append(np.where(kept, plain[:, _degree(n)].T @ swapped[:, _degree(n)], 0.0))
    swap = csr_array(block_diag(blocks, format="csr"))
    swap.eliminate_zeros()
    return swap


def _degree(n: int) -> slice:
    """Where the harmonics of degree n are."""
    return slice(n * n, (n + 1) ** 2)


def total_momentum_projectors(n: int, swap: csr_array) -> dict[int, csr_array]:
    """Projectors (3k, 3k), k = 2n + 1, on the fields of degree n with total momentum J.

    swap: `axes_swapped` up to n or more. Row 3 (m + n) + i is order m, direction i. With
    Lambda = r x grad the operator L.S maps a field u to Lambda x u; its eigenvalues n, -1 and
    -(n + 1) tell J = n + 1, n and n - 1.
    """
    m = np.arange(-n, n + 1)
    about_z = csr_array((-m.astype(float), (m[::-1] + n, m + n)), shape=(2 * n + 1, 2 * n + 1))
    swap = swap[_degree(n), _degree(n)]
    about_y = -swap @ about_z @ swap
    about_x = about_z @ about_y - about_y @ about_z
    spin = np.zeros((3, 3, 3))
    for axis in range(3):
        spin[axis, axis - 2, axis - 1], spin[axis, axis - 1, axis - 2] = -1.0, 1.0
    coupling = sum(kron(a, s) for a, s in zip((about_x, about_y, about_z), spin, strict=True))
    eigenvalues = {n + 1: n, n: -1, n - 1: -(n + 1)} if n > 0 else {1: 0}
    projectors = {}
    for total, own in eigenvalues.items():
        projector = one = eye_array(len(m) * 3, format="csr")
        for other in eigenvalues.values():
            if other != own:
                projector = projector @ (coupling - other * one) / (own - other)
        projectors[total] = csr_array(projector)
    return projectors


@cache
def single_layer_spectrum(degree: int) -> np.ndarray:
    """Eigenvalues of the single layer on the unit sphere, mu = 1: (degree + 1, 3).

    Row n is degree n, the columns are J = n - 1, n, n + 1 (Corona and Veerapaneni 2018, table 1).
    Zero where there is no such field (n = 0), and for n = 1, J = 0: the normal, which is the
    traction of a constant pressure inside and moves nothing.
    """
    n = np.arange(degree + 1.0)
    below = (n - 1.0) / ((2.0 * n - 1.0) * (2.0 * n + 1.0))
    above = (n + 2.0) / ((2.0 * n + 1.0) * (2.0 * n + 3.0))
    spectrum = np.column_stack([below, 1.0 / (2.0 * n + 1.0), above])
    spectrum[0, :2] = 0.0
    return spectrum


def exact_response(degree: int) -> np.ndarray:
    """How a sphere answers exactly, (degree + 1, 3): the inverse of its single layer's spectrum."""
    spectrum = single_layer_spectrum(degree)
    return np.divide(1.0, spectrum, out=np.zeros_like(spectrum), where=spectrum > 0.0)


def response_matrix(response) -> csr_array:
    """Traction moments for incoming harmonics, (3k, 3k): response[n, J - n + 1] on each subspace.

    response: (degree + 1, 3). Row 3 lm + i is harmonic lm, direction i.
    """
    swap, blocks = axes_swapped(len(response) - 1), []
    for n, values in enumerate(response):
        parts = total_momentum_projectors(n, swap).items()
        block = sum(values[total - n + 1] * projector for total, projector in parts)
        block.data[np.abs(block.data) < 1e-13 * np.abs(block.data).max()] = 0.0
        block.eliminate_zeros()
        blocks.append(block)
    return csr_array(block_diag(blocks, format="csr"))
