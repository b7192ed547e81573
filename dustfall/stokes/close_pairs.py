"""Two spheres near contact: what they are to others, hundreds of degrees of harmonics summed up.

The gap between two spheres is felt up to degrees of the order of the root of radius over gap, by
others only at low ones. So the degrees that a pair does not share with others are eliminated from
its own equations: with low (L) and high (H) degrees, and A the single layers and couplings of both,

    A_LL - A_LH A_HH^-1 A_HL

is an exact coupling of the low degrees, lubrication in all modes included: squeezing, shearing,
rolling, strain, and whatever flow of low degree the pair meets. It stays diagonal in the total
azimuthal number M. (The closed forms of Jeffrey and Onishi 1984 and Jeffrey 1992 are its lowest
degrees on a pair that is alone.)

High degrees are many, but what belongs to them changes slowly from one to the next: beyond a first
few the equations are written at a handful of degrees an octave, with polynomials in between.
"""

from functools import cache

import numpy as np
from numba import njit

from dustfall.stokes.harmonics import single_layer_spectrum
from dustfall.stokes.translation import COMPONENTS, down, gradient, up

FIRST_SPAN = 32
"""Degrees above the low ones, at least, that have their own equations."""

PANEL = 1.6
"""Ratio of the last and the first degree of a panel of degrees that share a polynomial."""

NODES = 14
"""Degrees of a panel that have equations: polynomials of degree 13 leave 1e-12 of a force."""

NEGLIGIBLE = 1e-22
"""Couplings below are left out."""


@cache
def _log_factorials(most: int) -> tuple[np.ndarray, np.ndarray]:
    """log k!, k = 0 ... most, as a multiple of 2^-30, whose sums are exact, and the rest."""
    exact = np.cumsum(np.log(np.maximum(np.arange(most + 1), 1).astype(np.longdouble)))
    coarse = np.round(exact * 2.0**30) / 2.0**30
    return coarse.astype(float), (exact - coarse).astype(float)


def _split(value) -> tuple[float, float]:
    """A logarithm as a multiple of 2^-30 and the rest."""
    exact = np.log(np.longdouble(value))
    coarse = np.round(exact * 2.0**30) / 2.0**30
    return float(coarse), float(exact - coarse)


@njit(cache=True)
def _moved(m, to, of, logs, ratios):
    """Degree `of` of an outer harmonic at the distance 1, in that of degree `to` about here.

    Of order m, over 4 pi, without the sign (-1)^(to + m), and both spheres' radii to the power of
    their degrees: the binomials of `translation_tables`, whose logarithms are summed without error.
    """
    if m > to or m > of:
        return 0.0
    coarse, fine = logs
    here, here_rest, there, there_rest = ratios
    n = to + of
    high = coarse[n] - 0.5 * (coarse[of + m] + coarse[to - m] + coarse[of - m] + coarse[to + m])
    low = fine[n] - 0.5 * (fine[of + m] + fine[to - m] + fine[of - m] + fine[to + m])
    high += to * here + of * there
    low += to * here_rest + of * there_rest
    return np.exp(high + low) / np.sqrt((2.0 * of + 1.0) * (2.0 * to + 1.0))


@njit(cache=True)
def _coupling(total, to, of, radii, distance, logs, ratios):
    """Entries (3, 3, to, of) of the coupling of the number M = `total`, as `axial_coupling`.

    Rows: components and degrees `to` of the velocity on the sphere at (0, 0, distance), times
    (-1)^to; columns: those of the traction on that at the origin.
    """
    a, b = radii
    out = np.zeros((3, 3, len(to), len(of)))
    for row in range(len(to)):
        t = to[row]
        for column in range(len(of)):
            l = of[column]  # noqa: E741
            if _moved(0, t, l, logs, ratios) < NEGLIGIBLE:
                continue
            psi_above = _moved(total, t + 1, l + 1, logs, ratios)
            psi_below = _moved(total, t + 1, l - 1, logs, ratios) if l > 0 else 0.0
            for s in range(3):
                m = total + COMPONENTS[s]
                if abs(m) > l:
                    continue
                partner = (3 - s) % 3
                scale = 1.0 if s == 0 else np.sqrt(0.5)
                psi = scale * up(partner, m, l) * psi_above
                if l > 0:
                    psi += scale * down(partner, m, l) * psi_below
                # Signs: (-1)^(t + 1 + M) of psi, (-1)^(t + k + m) of phi[t + k].
                odd = -1.0 if (total + 1) % 2 else 1.0
                psi *= odd * b
                odd = -1.0 if m % 2 else 1.0
                here = odd * _moved(abs(m), t, l, logs, ratios)
                above = odd * _moved(abs(m), t + 2, l, logs, ratios)
                beside = -odd * _moved(abs(m), t + 1, l, logs, ratios)
                for r in range(3):
                    order = total + COMPONENTS[r]
                    if abs(order) > t:
                        continue
                    weight = 1.0 if r == 0 else np.sqrt(0.5)
                    mixed = m + COMPONENTS[r]
                    times = 0.0
                    if abs(m) <= t + 2 and abs(mixed) <= t + 1:
                        times += down(partner, mixed, t + 1) * gradient(r, m, t + 2) * above
                    if t > 0 and abs(m) <= t and abs(mixed) <= t - 1:
                        times += up(partner, mixed, t - 1) * gradient(r, m, t) * here
                    value = -scale * times
                    if total <= t + 1:
                        value += gradient(r, total, t + 1) * psi / a
                    if s == 0 and abs(m) <= t + 1:
                        value -= distance / a * gradient(r, m, t + 1) * beside
                    value *= weight
                    if r == s:
                        value += here
                    out[r, s, row, column] = value / (2.0 * distance)
    return out


@njit(cache=True)
def _single_layer(total, degrees, radius, spectrum):
    """A sphere's own single layer (3, 3, degrees): components of the number M, degree by degree."""
    out = np.zeros((3, 3, len(degrees)))
    outward, inward = np.zeros(3), np.zeros(3)
    for p in range(len(degrees)):
        n = degrees[p]
        # y.f has degree n + 1 for J = n + 1 alone, and degree n - 1 for J = n - 1.
        for s in range(3):
            m = total + COMPONENTS[s]
            partner = (3 - s) % 3
            scale = 1.0 if s == 0 else np.sqrt(0.5)
            outward[s] = scale * up(partner, m, n) if abs(m) <= n else 0.0
            inward[s] = scale * down(partner, m, n) if abs(m) <= n and total < n else 0.0
        below, middle, above = spectrum[n]
        for vector, value in ((outward, above), (inward, below)):
            square = np.sum(vector**2)
            if square > 0.0:
                for r in range(3):
                    for s in range(3):
                        out[r, s, p] += (value - middle) * vector[r] * vector[s] / square
        for s in range(3):
            if abs(total + COMPONENTS[s]) <= n:
                out[s, s, p] += middle
    return out / radius


def _panels(low: int, high: int) -> tuple[np.ndarray, np.ndarray]:
    """Degrees above `low` that have equations (k,), and all up to `high` from their values.

    The latter is a matrix (high - low, k).
    """
    first = min(2 * low + FIRST_SPAN, high)
    nodes, blocks = [np.arange(low + 1, first + 1)], [np.eye(first - low)]
    while first < high:
        last = min(int(PANEL * first), high)
        every = np.arange(first + 1, last + 1)
        if last - first <= NODES:
            own = every
        else:
            angle = np.pi * np.arange(NODES) / (NODES - 1)
            own = np.unique(np.round(first + 1 + (last - first - 1) * 0.5 * (1 - np.cos(angle))))
        nodes.append(own.astype(int))
        blocks.append(_lagrange(own / last, every / last))
        first = last
    sizes = [block.shape for block in blocks]
    matrix = np.zeros(np.sum(sizes, axis=0))
    row = column = 0
    for block, (rows, columns) in zip(blocks, sizes, strict=True):
        matrix[row : row + rows, column : column + columns] = block
        row, column = row + rows, column + columns
    return np.concatenate(nodes), matrix


def _lagrange(nodes, points) -> np.ndarray:
    """Values at points (p,) of the polynomials that are one at one of the nodes (k,): (p, k)."""
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    out = np.empty((len(points), len(nodes)))
    for k in range(len(nodes)):
        others = np.delete(np.arange(len(nodes)), k)
        out[:, k] = np.prod((points[:, None] - nodes[others]) / apart[k, others], axis=1)
    return out


def effective_coupling(low: int, high, radii, distance: float) -> np.ndarray:
    """Coupling of two spheres at the degrees up to `low`, those up to `high` eliminated.

    high: of each sphere. radii: of the sphere at (0, 0, distance) and of that at the origin, all
    lengths in one unit. low >= 1. Returns the matrices (2k, 2k) of M = 0 ... low + 1, row by row
    one after the other, k = `block_size`: first the sphere at (0, 0, distance), ordered as the
    rows of `axial_coupling`, then the other. Symmetric; blocks of a sphere with itself come on top
    of its own single layer.
    """
    high = np.maximum(high, low + 1)
    logs = _log_factorials(2 ** int(np.ceil(np.log2(np.sum(high) + 8))))
    ratios = tuple(part for radius in radii for part in _split(radius / distance))
    radii = tuple(float(radius) for radius in radii)
    spectrum = single_layer_spectrum(int(np.max(high)))
    nodes, spread = zip(*(_panels(low, int(degree)) for degree in high), strict=True)
    own = [np.concatenate([np.arange(low + 1), degrees]) for degrees in nodes]
    every = [np.arange(degree + 1) for degree in high]
    out = []
    for total in range(low + 2):
        onto = _coupling(total, own[0], every[1], radii, distance, logs, ratios)
        back = _coupling(total, every[0], own[1], radii, distance, logs, ratios)
        layers = [
            _single_layer(total, degrees, radius, spectrum)
            for degrees, radius in zip(nodes, radii, strict=True)
        ]
        out.append(_eliminated(total, low, onto, back, layers, nodes, spread).ravel())
    return np.concatenate(out)


def _eliminated(total, low, onto, back, layers, nodes, spread) -> np.ndarray:
    """`effective_coupling` of one azimuthal number.

    onto, back: the coupling with rows, or columns, of the degrees that have equations, the other
    of all. layers: each sphere's single layer at `nodes`. spread: from values there to all degrees.
    """
    few, orders = low + 1, np.abs(total + np.array(COMPONENTS))
    lows = np.array([order <= np.arange(few) for order in orders]).ravel()
    highs = [np.array([order <= degrees for order in orders]).ravel() for degrees in nodes]
    # The second sphere's rows are the coupling's columns.
    back = back.transpose(1, 0, 3, 2)
    to_first, to_second = onto[..., few:] @ spread[1], back[..., few:] @ spread[0]

    def block(entries, rows, columns):
        """Entries (3, 3, t, l) of a block as a matrix."""
        flat = entries.transpose(0, 2, 1, 3).reshape(len(rows), len(columns))
        return flat[np.ix_(rows, columns)]

    def layer(own, kept):
        """Single layer (3, 3, t) of a sphere as a matrix."""
        entries = np.zeros((3, 3, own.shape[2], own.shape[2]))
        entries[:, :, np.arange(own.shape[2]), np.arange(own.shape[2])] = own
        return block(entries, kept, kept)

    high = np.block(
        [
            [layer(layers[0], highs[0]), block(to_first[:, :, few:], highs[0], highs[1])],
            [block(to_second[:, :, few:], highs[1], highs[0]), layer(layers[1], highs[1])],
        ]
    )
    size = np.count_nonzero(lows)
    nothing = [np.zeros((np.count_nonzero(h), size)) for h in highs]
    from_low = np.block(
        [
            [nothing[0], block(onto[:, :, few:, :few], highs[0], lows)],
            [block(back[:, :, few:, :few], highs[1], lows), nothing[1]],
        ]
    )
    to_low = np.block(
        [
            [nothing[0].T, block(to_first[:, :, :few], lows, highs[1])],
            [block(to_second[:, :, :few], lows, highs[0]), nothing[1].T],
        ]
    )
    coupling = -to_low @ np.linalg.solve(high, from_low)
    coupling[:size, size:] += block(onto[:, :, :few, :few], lows, lows)
    coupling[size:, :size] += block(back[:, :, :few, :few], lows, lows)
    # Degrees of the first sphere are back to their own sign.
    signs = np.ones(2 * size)
    signs[:size] = np.tile((-1.0) ** np.arange(few), 3)[lows]
    coupling *= signs[:, None] * signs
    return 0.5 * (coupling + coupling.T)
