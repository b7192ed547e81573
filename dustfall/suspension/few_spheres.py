"""Compiled forces on a sphere among a few: Rotne-Prager mobility, reflected dipoles, exact pairs.

`forces_among_neighbours` carries LANES scenes side by side: component k of row i of a scratch array
lies at [i, k * LANES + lane]. So the distances between components are constants of the program,
which is what the compiler needs to know before it turns the loops over lanes into vector
instructions.
"""

import numpy as np
from numba import njit

from dustfall.units import STOKES_DRAG

LANES = 64
"""Scenes side by side: several vectors wide, and scratch for six spheres fits a core's cache."""

_L = LANES

POWER = 6
"""The pair correction falls as (d_p / distance)^6 once two dipoles are reflected."""

# A sphere of radius a = d_p/2 held in a strain rate E and a vorticity 2 Omega exerts the stresslet
# 20/3 pi mu a^3 E and the torque 8 pi mu a^3 Omega (Kim & Karrila 1991); here over 6 pi mu a.
_STRESSLET = 10 / 9 * 0.25
_TORQUE = 4 / 3 * 0.25

TERMS = 7
"""Coefficients of the polynomials of the pair correction, highest power first."""

NO_CORRECTION = np.zeros((2, TERMS))
"""For forces without a pair correction."""

_compiled = njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")


@_compiled
def forces_among_neighbours(neighbours, reflections, correction):
    """Force (m, 3) [Re_p c_D] on the reference sphere of scenes (m, k, 3) [d_p] in flow along +y.

    `reflections` of the dipoles, `correction` (2, TERMS) polynomials in d_p / distance of a pair's
    forces along and across its line of centres (see `forces.formulas`).
    """
    count, others, _ = neighbours.shape
    # The reference sphere comes last, after its neighbours; so do its pairs.
    spheres = others + 1
    pairs = spheres * others // 2
    force = np.empty((count, 3))
    centre = np.zeros((spheres, 3 * LANES))
    pair = np.empty((pairs, 7 * LANES))
    # Blocks (i, j <= i) of the mobility, then of its Cholesky factor, row by row.
    factor = np.empty((pairs + spheres, 9 * LANES))
    total = np.empty((spheres, 3 * LANES))
    change = np.empty((spheres, 3 * LANES))
    gradient = np.empty((spheres, 8 * LANES))
    own = np.empty(3 * LANES)
    for start in range(0, count, LANES):
        for lane in range(LANES):
            scene = neighbours[min(start + lane, count - 1)]
            for j in range(others):
                for k in range(3):
                    centre[j, k * LANES + lane] = scene[j, k]
        _assemble(factor, pair, centre)
        _factorise(factor, spheres)
        total[:] = 0.0
        total[:, LANES : 2 * LANES] = 1.0
        _solve(factor, total)
        own[:] = 0.0
        for j in range(others):
            _correct(own, total[others], total[j], pair[pairs - others + j], correction)
        change[:] = total
        for _ in range(reflections):
            _reflect(change, gradient, pair)
            _solve(factor, change)
            for i in range(spheres):
                for k in range(3 * LANES):
                    total[i, k] += change[i, k]
        for lane in range(min(LANES, count - start)):
            for k in range(3):
                value = total[others, k * LANES + lane] + own[k * LANES + lane]
                force[start + lane, k] = STOKES_DRAG * value
    return force


@_compiled
def _assemble(factor, pair, centre):
    number = 0
    for i in range(len(centre)):
        row = i * (i + 1) // 2
        for j in range(i):
            _couple(factor[row + j], pair[number], centre[i], centre[j])
            number += 1
        for k in range(9):
            factor[row + i, k * LANES : (k + 1) * LANES] = 1.0 if k % 4 == 0 else 0.0


@_compiled
def _couple(block, pair, here, there):
    """Write a pair's mobility, its separation and the coefficients of its gradients."""
    for lane in range(LANES):
        x = here[lane] - there[lane]
        y = here[_L + lane] - there[_L + lane]
        z = here[2 * _L + lane] - there[2 * _L + lane]
        # The floor keeps the mobility of two coincident neighbours positive definite.
        distance2 = max(x * x + y * y + z * z, 1e-12)
        inverse = 1 / np.sqrt(distance2)
        square = inverse * inverse
        if inverse < 1.0:
            across = 0.375 * inverse * (1 + square / 6)
            along = 0.375 * inverse * square * (1 - square / 2)
        else:
            across = 1 - 0.5625 / inverse
            along = 0.1875 * inverse
        block[lane] = across + along * x * x
        block[_L + lane] = along * x * y
        block[2 * _L + lane] = along * x * z
        block[3 * _L + lane] = along * x * y
        block[4 * _L + lane] = across + along * y * y
        block[5 * _L + lane] = along * y * z
        block[6 * _L + lane] = along * x * z
        block[7 * _L + lane] = along * y * z
        block[8 * _L + lane] = across + along * z * z
        # Overlapping neighbours keep the other coefficients of contact: what they induce in each
        # other fades with their distance.
        inverse = min(inverse, 1.0)
        square = inverse * inverse
        cube = 0.375 * inverse * square
        pair[lane] = x
        pair[_L + lane] = y
        pair[2 * _L + lane] = z
        # Gradient of the Rotne-Prager velocity with Faxen's a^2/10 of the strain, see _gradient.
        p, s = -0.4 * cube * square, cube * square * (2 * square - 3)
        pair[3 * _L + lane], pair[4 * _L + lane] = p, s
        pair[5 * _L + lane] = -(2 * p + s * distance2) / 3
        pair[6 * _L + lane] = -cube


@_compiled
def _factorise(factor, spheres):
    """Cholesky factor in blocks of 3 x 3; its diagonal is kept inverted."""
    for j in range(spheres):
        column = j * (j + 1) // 2
        for i in range(j, spheres):
            row = i * (i + 1) // 2
            for k in range(j):
                _subtract_product(factor[row + j], factor[row + k], factor[column + k])
            if i == j:
                _factorise_block(factor[row + j])
            else:
                _divide_block(factor[row + j], factor[column + j])


@_compiled
def _subtract_product(block, left, right):
    """block -= left right^T."""
    for k in range(3):
        # One row at a time: more stores in a loop and the compiler gives up proving them apart.
        own = block[3 * k * LANES : (3 * k + 3) * LANES]
        row = left[3 * k * LANES : (3 * k + 3) * LANES]
        for lane in range(LANES):
            a, b, c = row[lane], row[_L + lane], row[2 * _L + lane]
            own[lane] -= a * right[lane] + b * right[_L + lane] + c * right[2 * _L + lane]
            own[_L + lane] -= (
                a * right[3 * _L + lane] + b * right[4 * _L + lane] + c * right[5 * _L + lane]
            )
            own[2 * _L + lane] -= (
                a * right[6 * _L + lane] + b * right[7 * _L + lane] + c * right[8 * _L + lane]
            )


@_compiled
def _factorise_block(block):
    for lane in range(LANES):
        xx = 1 / np.sqrt(block[lane])
        yx = block[3 * _L + lane] * xx
        zx = block[6 * _L + lane] * xx
        yy = 1 / np.sqrt(block[4 * _L + lane] - yx * yx)
        zy = (block[7 * _L + lane] - zx * yx) * yy
        zz = 1 / np.sqrt(block[8 * _L + lane] - zx * zx - zy * zy)
        block[lane], block[3 * _L + lane], block[4 * _L + lane] = xx, yx, yy
        block[6 * _L + lane], block[7 * _L + lane], block[8 * _L + lane] = zx, zy, zz


@_compiled
def _divide_block(block, diagonal):
    """block <- block diagonal^-T."""
    for k in range(3):
        row = block[3 * k * LANES : (3 * k + 3) * LANES]
        for lane in range(LANES):
            x = row[lane] * diagonal[lane]
            y = (row[_L + lane] - x * diagonal[3 * _L + lane]) * diagonal[4 * _L + lane]
            z = row[2 * _L + lane] - x * diagonal[6 * _L + lane] - y * diagonal[7 * _L + lane]
            row[lane], row[_L + lane] = x, y
            row[2 * _L + lane] = z * diagonal[8 * _L + lane]


@_compiled
def _solve(factor, vector):
    """Forces that move the spheres at given velocities, in place."""
    for i in range(len(vector)):
        row = i * (i + 1) // 2
        for j in range(i):
            _substitute(vector[i], vector[j], factor[row + j], 3, 1)
        _substitute_forward(vector[i], factor[row + i])
    for i in range(len(vector) - 1, -1, -1):
        row = i * (i + 1) // 2
        _substitute_back(vector[i], factor[row + i])
        for j in range(i):
            _substitute(vector[j], vector[i], factor[row + j], 1, 3)


@_compiled
def _substitute(own, other, block, row, column):
    """own -= block other, or block^T other with the strides swapped."""
    for k in range(3):
        line = own[k * LANES : (k + 1) * LANES]
        first = block[row * k * LANES :]
        second = block[(row * k + column) * LANES :]
        third = block[(row * k + 2 * column) * LANES :]
        for lane in range(LANES):
            line[lane] -= (
                first[lane] * other[lane]
                + second[lane] * other[_L + lane]
                + third[lane] * other[2 * _L + lane]
            )


@_compiled
def _substitute_forward(own, diagonal):
    for lane in range(LANES):
        x = own[lane] * diagonal[lane]
        y = (own[_L + lane] - diagonal[3 * _L + lane] * x) * diagonal[4 * _L + lane]
        z = own[2 * _L + lane] - diagonal[6 * _L + lane] * x - diagonal[7 * _L + lane] * y
        own[lane], own[_L + lane] = x, y
        own[2 * _L + lane] = z * diagonal[8 * _L + lane]


@_compiled
def _substitute_back(own, diagonal):
    for lane in range(LANES):
        z = own[2 * _L + lane] * diagonal[8 * _L + lane]
        y = (own[_L + lane] - diagonal[7 * _L + lane] * z) * diagonal[4 * _L + lane]
        x = own[lane] - diagonal[3 * _L + lane] * y - diagonal[6 * _L + lane] * z
        own[lane], own[_L + lane] = x * diagonal[lane], y
        own[2 * _L + lane] = z


@_compiled
def _reflect(vector, gradient, pair):
    """Forces in, velocities out: of the dipoles that the forces' flow induces on the spheres."""
    gradient[:] = 0.0
    number = 0
    for i in range(len(vector)):
        for j in range(i):
            _gradient(gradient[i], vector[j], pair[number], 1.0)
            _gradient(gradient[j], vector[i], pair[number], -1.0)
            number += 1
    vector[:] = 0.0
    number = 0
    for i in range(len(vector)):
        for j in range(i):
            _velocity(vector[j], gradient[i], pair[number], 1.0)
            _velocity(vector[i], gradient[j], pair[number], -1.0)
            number += 1


@_compiled
def _gradient(gradient, force, pair, sign):
    """Add the strain rate (xx, yy, xy, xz, yz) and rotation that a force causes at r = sign pair.

    With f the force and q = r.f: E = p (f r + r f) + s q r r + t q I, trace free, and
    Omega = w f x r, p, s, t and w as `_couple` left them.
    """
    for lane in range(LANES):
        x, y, z = sign * pair[lane], sign * pair[_L + lane], sign * pair[2 * _L + lane]
        p = pair[3 * _L + lane]
        fx, fy, fz = force[lane], force[_L + lane], force[2 * _L + lane]
        q = x * fx + y * fy + z * fz
        sq = pair[4 * _L + lane] * q
        tq = pair[5 * _L + lane] * q
        w = pair[6 * _L + lane]
        gradient[lane] += (2 * p * fx + sq * x) * x + tq
        gradient[_L + lane] += (2 * p * fy + sq * y) * y + tq
        gradient[2 * _L + lane] += p * (fx * y + fy * x) + sq * x * y
        gradient[3 * _L + lane] += p * (fx * z + fz * x) + sq * x * z
        gradient[4 * _L + lane] += p * (fy * z + fz * y) + sq * y * z
        gradient[5 * _L + lane] += w * (fy * z - fz * y)
        gradient[6 * _L + lane] += w * (fz * x - fx * z)
        gradient[7 * _L + lane] += w * (fx * y - fy * x)


@_compiled
def _velocity(velocity, gradient, pair, sign):
    """Add the velocity that a sphere's stresslet and torque cause: `_gradient` transposed."""
    for lane in range(LANES):
        x, y, z = sign * pair[lane], sign * pair[_L + lane], sign * pair[2 * _L + lane]
        xx, yy = gradient[lane], gradient[_L + lane]
        xy, xz, yz = gradient[2 * _L + lane], gradient[3 * _L + lane], gradient[4 * _L + lane]
        sx = xx * x + xy * y + xz * z
        sy = xy * x + yy * y + yz * z
        sz = xz * x + yz * y - (xx + yy) * z
        p = 2 * _STRESSLET * pair[3 * _L + lane]
        s = _STRESSLET * pair[4 * _L + lane] * (sx * x + sy * y + sz * z)
        w = _TORQUE * pair[6 * _L + lane]
        ox, oy, oz = gradient[5 * _L + lane], gradient[6 * _L + lane], gradient[7 * _L + lane]
        velocity[lane] += p * sx + s * x + w * (y * oz - z * oy)
        velocity[_L + lane] += p * sy + s * y + w * (z * ox - x * oz)
        velocity[2 * _L + lane] += p * sz + s * z + w * (x * oy - y * ox)


@_compiled
def _correct(own, reference, neighbour, pair, correction):
    """Add a pair's correction in the flow that the other spheres cause at it, u.

    u, the mean over the pair, is the flow that its Rotne-Prager forces balance.
    """
    for lane in range(LANES):
        x, y, z = pair[lane], pair[_L + lane], pair[2 * _L + lane]
        inverse = 1 / max(x * x + y * y + z * z, 1.0)
        root = np.sqrt(inverse)
        ux = 0.5 * (reference[lane] + neighbour[lane])
        uy = 0.5 * (reference[_L + lane] + neighbour[_L + lane])
        uz = 0.5 * (reference[2 * _L + lane] + neighbour[2 * _L + lane])
        across = 1 + 0.375 * root * (1 + inverse / 6)
        along = 0.375 * root * inverse * (1 - 0.5 * inverse) * (ux * x + uy * y + uz * z)
        ux, uy, uz = across * ux + along * x, across * uy + along * y, across * uz + along * z
        straight, sideways = 0.0, 0.0
        for k in range(TERMS):
            straight = straight * root + correction[0, k]
            sideways = sideways * root + correction[1, k]
        far = inverse * inverse * inverse
        sideways *= far
        along = (straight * far - sideways) * inverse * (ux * x + uy * y + uz * z)
        own[lane] += sideways * ux + along * x
        own[_L + lane] += sideways * uy + along * y
        own[2 * _L + lane] += sideways * uz + along * z
