"""The flow that a traction on one sphere makes on another, exactly, harmonic by harmonic.

mu = 1, lengths are in radii of a sphere of diameter d_p; the spheres' own radii may differ.
Moments are integrals of traction times a harmonic over a sphere. Seen along the line of centres the
coupling of two spheres does not mix azimuthal numbers: each total number M has its own small real
matrix, which depends on the distance alone. With the potentials Phi_c of the traction's components
f_c and Psi of y.f, the velocity is u_c = (Phi_c - x . d_c Phi + d_c Psi) / 8 pi, since
G = I/r - (x - y) grad 1/r; the potentials are moved from one centre to the other as those of
electrostatics are, and gradients and products with x act on solid harmonics by short recurrences.

Within the number M the z component has harmonics of order M, and the combinations
(f_x +- i f_y) / sqrt 2 those of order M +- 1. Harmonics are Z_lm = N P_l^|m| exp(i m phi) without
the Condon-Shortley sign; real and imaginary parts do not mix.
"""

from functools import cache

import numpy as np
from numba import njit
from scipy.special import comb

from dustfall.stokes.harmonics import axes_swapped

MOST_DEGREE = 40
"""Largest degree of the harmonics that a pair may exchange."""

COMPONENTS = (0, 1, -1)
"""Azimuthal number that a component adds: z, (x + iy) / sqrt 2, (x - iy) / sqrt 2."""


# How a solid harmonic of degree l and order m, |m| <= l, changes with a component c of d or of x:
# d_c makes it one of degree l - 1; x_c of length 1 makes it two, of degrees l + 1 and l - 1.


@njit(cache=True)
def gradient(c, m, l):  # noqa: E741
    """Factor of d_c of a regular solid harmonic."""
    ratio = (2 * l + 1.0) / max(2 * l - 1.0, 1.0)
    if c == 0:
        return np.sqrt(ratio * (l - m) * (l + m))
    if c == 1:
        return (-1.0 if m >= 0 else 1.0) * np.sqrt(max(ratio * (l - m) * (l - m - 1), 0.0))
    return (1.0 if m >= 1 else -1.0) * np.sqrt(max(ratio * (l + m) * (l + m - 1), 0.0))


@njit(cache=True)
def up(c, m, l):  # noqa: E741
    """Factor of the part of degree l + 1 of a product with x_c."""
    above = (2 * l + 1.0) * (2 * l + 3.0)
    if c == 0:
        return np.sqrt(((l + 1) ** 2 - m * m) / above)
    if c == 1:
        return (1.0 if m >= 0 else -1.0) * np.sqrt((l + m + 1) * (l + m + 2) / above)
    return (-1.0 if m >= 1 else 1.0) * np.sqrt((l - m + 1) * (l - m + 2) / above)


@njit(cache=True)
def down(c, m, l):  # noqa: E741
    """Factor of the part of degree l - 1 of a product with x_c."""
    below = max(4.0 * l * l - 1.0, 1.0)
    if c == 0:
        return np.sqrt((l * l - m * m) / below)
    if c == 1:
        return (-1.0 if m >= 0 else 1.0) * np.sqrt(max((l - m) * (l - m - 1) / below, 0.0))
    return (1.0 if m >= 1 else -1.0) * np.sqrt(max((l + m) * (l + m - 1) / below, 0.0))


@cache
def translation_tables(degree: int = MOST_DEGREE):
    """What does not depend on the pair: moved potentials, gradients, products, swapped axes."""
    size = degree + 3
    m, to, of = np.ogrid[:size, :size, :size]
    # Z_lm / r^(l+1) about a centre at the distance 1, in the regular solid harmonics about here.
    moved = np.sqrt(comb(of + to, of + m) * comb(of + to, of - m) * (2 * of + 1) / (2 * to + 1))
    moved = np.where((m <= to) & (m <= of), moved * (-1.0) ** (to + m), 0.0)
    moved *= 4.0 * np.pi / (2 * of + 1)

    # Arrays [component, m + 2, l]: m starts at -2.
    recurrences = np.zeros((3, 3, size + 2, size))
    for order in range(-2, size):
        for n in range(abs(order), size):
            for c in range(3):
                for kind, of_component in enumerate((gradient, up, down)):
                    recurrences[kind, c, order + 2, n] = of_component(c, order, n)
    swap = axes_swapped(degree)
    return (
        moved,
        *recurrences,
        swap.data,
        swap.indices.astype(np.int64),
        swap.indptr.astype(np.int64),
    )


@njit(cache=True)
def block_size(degree, total):
    """Number of coefficients of the total azimuthal number M = `total`, 0 ... degree + 1."""
    size = 0
    for step in COMPONENTS:
        size += max(0, degree + 1 - abs(total + step))
    return size


@njit(cache=True)
def block_sizes(degree):
    """`block_size` of all M, and the number of entries of the matrices of all M."""
    sizes, entries = np.empty(degree + 2, dtype=np.int64), 0
    for total in range(degree + 2):
        sizes[total] = block_size(degree, total)
        entries += sizes[total] ** 2
    return sizes, entries


@njit(cache=True)
def put_coupling_of_forces(centre, other, radii, out):
    """Write the coupling of the moments of degree 0 of two spheres, row by row: out (9,).

    centre, other: (3,), radii: of both. The Rotne-Prager tensor, which is exact for uniform
    tractions (Rotne and Prager 1969, Zuk et al. 2014 for two radii), times 4 pi, since moments
    and velocities of degree 0 are over and times the root of that.
    """
    squares = radii[0] ** 2 + radii[1] ** 2
    square = 0.0
    for i in range(3):
        square += (centre[i] - other[i]) ** 2
    distance = np.sqrt(square)
    along = (1.0 - squares / square) / square
    for i in range(3):
        for j in range(3):
            value = along * (centre[i] - other[i]) * (centre[j] - other[j])
            if i == j:
                value += 1.0 + squares / (3.0 * square)
            out[3 * i + j] = value / (2.0 * distance)


@njit(cache=True)
def axial_coupling(degree, distance, radii, tables):
    """Matrices of the numbers M = 0, 1, ... of a pair along z, row by row one after the other.

    Rows: velocity on the sphere at (0, 0, distance), whose radius is the first; columns: traction
    on that at the origin.
    """
    moved, gradient, up, down, _, _, _ = tables
    sizes, entries = block_sizes(degree)
    out = np.empty(entries)
    length = degree + 3
    powers = np.empty(2 * length)
    powers[0] = 1.0
    for t in range(2 * length - 1):
        powers[t + 1] = powers[t] / distance
    here, there = np.ones(length + 1), np.ones(length + 1)
    for t in range(length):
        here[t + 1] = here[t] * radii[0]
        there[t + 1] = there[t] * radii[1]
    reach = distance / radii[0]
    # Of the column's traction: potentials of its component and of y.f, and d_r of the former.
    phi, psi, slope = np.empty(length), np.empty(length), np.zeros(length)
    begin = 0
    for total in range(degree + 2):
        size = sizes[total]
        column = 0
        for s in range(3):
            m = total + COMPONENTS[s]
            # a.b = a_z b_z + (a_+ b_- + a_- b_+) in the scaled components: the partner of s.
            partner = (3 - s) % 3
            scale = 1.0 if s == 0 else np.sqrt(0.5)
            for l in range(abs(m), degree + 1):  # noqa: E741
                above = scale * up[partner, m + 2, l]
                below = scale * down[partner, m + 2, l] if l > 0 else 0.0
                for t in range(length):
                    grown = here[t] * there[l]
                    phi[t] = moved[abs(m), t, l] * powers[l + t + 1] * grown
                    psi[t] = above * moved[total, t, l + 1] * powers[l + t + 2] * there[2]
                    if l > 0:
                        psi[t] += below * moved[total, t, l - 1] * powers[l + t]
                    psi[t] *= grown / radii[0]
                row = 0
                for r in range(3):
                    weight = 1.0 if r == 0 else np.sqrt(0.5)
                    order = total + COMPONENTS[r]
                    mixed = m + COMPONENTS[r]
                    for t in range(length - 1):
                        slope[t] = gradient[r, m + 2, t + 1] * phi[t + 1]
                    for t in range(abs(order), degree + 1):
                        times = down[partner, mixed + 2, t + 1] * slope[t + 1]
                        if t > 0:
                            times += up[partner, mixed + 2, t - 1] * slope[t - 1]
                        value = gradient[r, total + 2, t + 1] * psi[t + 1] - scale * times
                        if s == 0:
                            value -= reach * slope[t]
                        value *= weight
                        if r == s:
                            value += phi[t]
                        out[begin + row * size + column] = value / (8.0 * np.pi)
                        row += 1
                column += 1
        begin += size * size
    return out


@njit(cache=True)
def turns_to(degree, direction):
    """Cosines and sines of m times the azimuth, then of m times the polar angle: (4, degree + 2).

    direction: (3,), unit vector. m = 0 ... degree + 1; a recurrence, so nothing is trigonometric.
    """
    out = np.empty((4, degree + 2))
    across = np.sqrt(direction[0] ** 2 + direction[1] ** 2)
    azimuth = (direction[0] / across, direction[1] / across) if across > 0.0 else (1.0, 0.0)
    for row, (c, s) in ((0, azimuth), (2, (direction[2], across))):
        out[row, 0], out[row + 1, 0] = 1.0, 0.0
        for m in range(degree + 1):
            cosine, sine = out[row, m], out[row + 1, m]
            out[row, m + 1] = c * cosine - s * sine
            out[row + 1, m + 1] = s * cosine + c * sine
    return out


@njit(cache=True)
def _turned_about_z(degree, cosines, sines, sense, field):
    """Turn a vector field, harmonics and components, about z in place; sense: 1 or -1.

    cosines, sines: of m times the angle, m = 0 ... degree, and 1 for the components.
    """
    for n in range(degree + 1):
        middle = n * n + n
        for m in range(1, n + 1):
            c, s = cosines[m], sense * sines[m]
            for i in range(3):
                even, odd = field[middle + m, i], field[middle - m, i]
                field[middle + m, i] = c * even - s * odd
                field[middle - m, i] = s * even + c * odd
    c1, s1 = cosines[1], sense * sines[1]
    for k in range((degree + 1) ** 2):
        x, y = field[k, 0], field[k, 1]
        field[k, 0] = c1 * x - s1 * y
        field[k, 1] = s1 * x + c1 * y


@njit(cache=True)
def _axes_swapped(degree, field, tables, out):
    """The field with y and z exchanged, harmonics and components."""
    _, _, _, _, data, indices, begin = tables
    for k in range((degree + 1) ** 2):
        x = y = z = 0.0
        for p in range(begin[k], begin[k + 1]):
            v, other = data[p], indices[p]
            x += v * field[other, 0]
            z += v * field[other, 1]
            y += v * field[other, 2]
        out[k, 0], out[k, 1], out[k, 2] = x, y, z


@njit(cache=True)
def turn_to_axis(degree, turns, tables, field, spare):
    """Turn the frame so that the direction of `turns_to` becomes z; field (k, 3), in place."""
    _turned_about_z(degree, turns[0], turns[1], -1.0, field)
    _axes_swapped(degree, field, tables, spare)
    _turned_about_z(degree, turns[2], turns[3], 1.0, spare)
    _axes_swapped(degree, spare, tables, field)


@njit(cache=True)
def turn_from_axis(degree, turns, tables, field, spare):
    """Undo `turn_to_axis`."""
    _axes_swapped(degree, field, tables, spare)
    _turned_about_z(degree, turns[2], turns[3], -1.0, spare)
    _axes_swapped(degree, spare, tables, field)
    _turned_about_z(degree, turns[0], turns[1], 1.0, field)


@njit(cache=True)
def gather_azimuthal(degree, field, out):
    """Write a field (k, 3) as its azimuthal numbers: out (size, 2), real and imaginary parts.

    With F_m = (cosine - i sine) / sqrt 2 for m > 0 and its conjugate for -m.
    """
    half = np.sqrt(0.5)
    p = 0
    for total in range(degree + 2):
        for n in range(total, degree + 1):
            k = n * n + n
            if total == 0:
                out[p, 0], out[p, 1] = field[k, 2], 0.0
            else:
                out[p, 0], out[p, 1] = half * field[k + total, 2], -half * field[k - total, 2]
            p += 1
        m = total + 1
        for n in range(m, degree + 1):
            k = n * n + n
            # (F^x + i F^y) / sqrt 2, and F = (c - i s) / sqrt 2.
            out[p, 0] = 0.5 * (field[k + m, 0] + field[k - m, 1])
            out[p, 1] = 0.5 * (field[k + m, 1] - field[k - m, 0])
            p += 1
        m = total - 1
        for n in range(abs(m), degree + 1):
            k = n * n + n
            if m == 0:
                out[p, 0], out[p, 1] = half * field[k, 0], -half * field[k, 1]
            elif m > 0:
                out[p, 0] = 0.5 * (field[k + m, 0] - field[k - m, 1])
                out[p, 1] = -0.5 * (field[k + m, 1] + field[k - m, 0])
            else:
                out[p, 0] = 0.5 * (field[k + 1, 0] + field[k - 1, 1])
                out[p, 1] = -0.5 * (field[k + 1, 1] - field[k - 1, 0])
            p += 1


@njit(cache=True)
def scatter_azimuthal(degree, values, field):
    """Undo `gather_azimuthal`."""
    half = np.sqrt(0.5)
    field[: (degree + 1) ** 2] = 0.0
    p = 0
    for total in range(degree + 2):
        for n in range(total, degree + 1):
            k = n * n + n
            if total == 0:
                field[k, 2] = values[p, 0]
            else:
                field[k + total, 2] = values[p, 0] / half
                field[k - total, 2] = -values[p, 1] / half
            p += 1
        m = total + 1
        for n in range(m, degree + 1):
            k = n * n + n
            field[k + m, 0] += values[p, 0]
            field[k - m, 1] += values[p, 0]
            field[k + m, 1] += values[p, 1]
            field[k - m, 0] -= values[p, 1]
            p += 1
        m = total - 1
        for n in range(abs(m), degree + 1):
            k = n * n + n
            if m == 0:
                field[k, 0], field[k, 1] = values[p, 0] / half, -values[p, 1] / half
            elif m > 0:
                field[k + m, 0] += values[p, 0]
                field[k - m, 1] -= values[p, 0]
                field[k + m, 1] -= values[p, 1]
                field[k - m, 0] -= values[p, 1]
            p += 1
