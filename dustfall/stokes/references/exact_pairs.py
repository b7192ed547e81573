"""Two equal spheres, fixed in a uniform Stokes flow: exact series for any gap, touching included.

In bispherical coordinates both spheres are coordinate surfaces, at cosh(alpha) = distance / d_p,
and the flow is a series in (n + 1/2). The series are written here in terms that are all positive
and that neither overflow far away nor cancel near contact.
"""

import math

import numpy as np
from numba import njit, vectorize

from dustfall.spheres import checked_numbers, flow_direction
from dustfall.units import STOKES_DRAG

SMALLEST_GAP = 5e-7
"""Gap [d_p] down to which the series are summed; below, the force is linear in the gap.

A pair that moves as one has no lubrication: the logarithms of the two resistances cancel (Jeffrey
and Onishi 1984), and the tangent is off by no more than 1e-12.
"""

NEGLIGIBLE = 1e-17
"""Terms of the series are added until one is smaller than this."""


def pair_drag(distance):
    """Drag on each of two fixed spheres over the drag on a lone one.

    distance: centre distance [d_p], any shape, at least 1 (touching). Returns (along, across), each
    of that shape: for a flow along the line of centres (Stimson and Jeffery 1926) and across it
    (in the coordinates of Dean and O'Neill 1963 and Goldman, Cox and Brenner 1966; the spheres are
    held against rotation), to a relative 1e-12.
    Raises ValueError for distances below 1 or not finite.
    """
    distance = np.asarray(distance, dtype=float)
    allowed = np.isfinite(distance) & (distance >= 1.0)
    if not allowed.all():
        raise ValueError(
            f"distance {distance[~allowed].flat[0]} d_p: it must be finite and at least 1 d_p, "
            "where the spheres touch"
        )
    gap = distance - 1.0
    return _continued(_along, gap), _continued(_across, gap)


def forces_on_two_spheres(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Exact force on each of two fixed spheres in a uniform flow.

    centres: (2, 3) [d_p]. flow: (3,), velocity far away; forces are made dimensionless by its
    magnitude. Returns (2, 3) in Re_p c_D: an isolated sphere feels 24 along the flow.
    Raises ValueError for other shapes, values that are not finite, and spheres that overlap.
    """
    centres, flow = checked_numbers("centres", centres), flow_direction(flow)
    if centres.shape != (2, 3):
        raise ValueError(f"centres must have the shape (2, 3), not {centres.shape}")
    line = centres[1] - centres[0]
    distance = np.linalg.norm(line)
    along, across = pair_drag(distance)
    direction = line / distance
    parallel = direction * (direction @ flow)
    force = STOKES_DRAG * (along * parallel + across * (flow - parallel))
    return np.stack([force, force])


def _continued(series, gap):
    """A series where the gap is wide enough to sum it, its tangent elsewhere."""
    value = series(np.maximum(gap, SMALLEST_GAP))
    if np.any(gap < SMALLEST_GAP):
        start, later = series(np.array([1.0, 2.0]) * SMALLEST_GAP)
        value = value + np.minimum(gap / SMALLEST_GAP - 1.0, 0.0) * (later - start)
    return value


@njit(cache=True)
def _bispherical(gap):
    """The coordinate alpha of a sphere, from cosh(alpha) = 1 + gap."""
    return math.log1p(gap + math.sqrt(gap * (gap + 2.0)))


@vectorize(cache=True)
def _along(gap):
    """Both spheres translate along their line of centres (Stimson and Jeffery 1926).

    With k = 2n + 1 their series is 4/3 sinh(alpha) times the sum of n(n+1) / ((2n-1)(2n+3)) times

        (2 (1 - exp(-k alpha)) + k sinh(2 alpha) + k^2 sinh(alpha)^2)
        / (2 sinh(k alpha) + k sinh(2 alpha)),

    where the difference that they write is carried out. Above and below the line stand times
    exp(-k alpha) here.
    """
    alpha = _bispherical(gap)
    sinh = -0.5 * math.expm1(-2.0 * alpha)  # sinh(alpha) exp(-alpha)
    sinh2 = -0.5 * math.expm1(-4.0 * alpha)  # sinh(2 alpha) exp(-2 alpha)
    total = 0.0
    n = 0
    term = 1.0
    while term > NEGLIGIBLE:
        n += 1
        k = 2.0 * n + 1.0
        above = -2.0 * math.expm1(-k * alpha) * math.exp((1.0 - k) * alpha)
        above += (k * sinh2 + k * k * sinh * sinh) * math.exp((3.0 - k) * alpha)
        below = -math.expm1(-2.0 * k * alpha) + k * sinh2 * math.exp((2.0 - k) * alpha)
        term = n * (n + 1.0) / ((2.0 * n - 1.0) * (2.0 * n + 3.0)) * sinh * above / below
        total += term
    return 4.0 / 3.0 * total


@vectorize(cache=True)
def _across(gap):
    """Both spheres translate across their line of centres and do not rotate.

    Pressure and velocity are (Dean and O'Neill 1963), with cosines and sines of the azimuth,
    p ~ Q, u_rho ~ rho Q / c + U2 + U0, u_phi ~ U2 - U0, u_z ~ z Q / c + 2 W, where W is a series of
    A_n sinh((n + 1/2) xi) and Q, U0, U2 are series of cosh((n + 1/2) xi). No slip gives the other
    coefficients by a_n = A_n sinh((n + 1/2) alpha), and div u = 0 then reads, after division by
    cosh(alpha), with k = n + 1/2, g_k = 1 - k sinh(2 alpha) / sinh(2 k alpha), x_n = -g_k a_n,

        (gap_n + lower_n + upper_n) x_n - lower_n x_(n-1) - upper_n x_(n+1) = load_n.

    The drag is what the flow alone would give minus the sum of weight_n x_n. All numbers here are
    positive, so the elimination subtracts nowhere (Grassmann, Taksar and Heyman 1985). It needs no
    second sweep: what each further n changes in the sum is known when n is reached.
    """
    alpha = _bispherical(gap)
    decay = math.exp(-alpha)
    sech = 2.0 * decay / (1.0 + decay * decay)
    sinh = -0.5 * math.expm1(-2.0 * alpha)  # sinh(alpha) exp(-alpha)
    tanh = 2.0 * sinh / (1.0 + decay * decay)
    one_less_sech = math.expm1(-alpha) ** 2 / (1.0 + decay * decay)
    factor = 16.0 / 3.0 * sinh**4 * 2.0 / (1.0 + decay * decay)

    total = 8.0 / 3.0 * sinh / (1.0 + decay)
    excess = upper = load = weight = 0.0
    pivot = change = 1.0
    n = 0
    while change > NEGLIGIBLE:
        n += 1
        k = n + 0.5
        # cosh^2, sinh^2(alpha) and sinh cosh over cosh(k alpha)^2 + sinh(alpha)^2.
        twice = math.exp(-2.0 * k * alpha)
        crossed = (2.0 * sinh) ** 2 * math.exp((2.0 - 2.0 * k) * alpha)
        scale = (1.0 + twice) ** 2 + crossed
        cosh_cosh = (1.0 + twice) ** 2 / scale
        sinh_sinh = crossed / scale
        sinh_cosh = (1.0 - twice * twice) / scale

        g = _one_less_ratio(k, alpha)
        row_gap = 2.0 * one_less_sech * cosh_cosh + (5.0 / g - 2.0 * sech) * sinh_sinh
        row_gap += tanh * sinh_cosh / (k * g) + 4.0 * sech / ((2.0 * n + 3.0) * (2.0 * n - 1.0))
        lower = sech * (1.0 - 1.0 / (2.0 * n - 1.0))
        carried = lower / pivot
        excess = row_gap + carried * excess
        mode = math.exp((1.5 - k) * alpha) * (1.0 - twice) / scale
        weight = n * (n + 1.0) / (k * g) * mode + upper / pivot * weight
        load = mode + carried * load
        upper = sech * (1.0 + 1.0 / (2.0 * n + 3.0))
        pivot = excess + upper
        change = factor * load * weight / pivot
        uniform = 8.0 / 3.0 * sinh * math.exp((1.0 - 2.0 * k) * alpha) / (1.0 + twice)
        total += uniform - change
        change += uniform
    return total


@njit(cache=True)
def _one_less_ratio(k, alpha):
    """1 - k sinh(2 alpha) / sinh(2 k alpha) for k > 1, without cancellation for small alpha."""
    if 2.0 * k * alpha > 1.0:
        ratio = math.expm1(-4.0 * alpha) / math.expm1(-4.0 * k * alpha)
        return 1.0 - k * ratio * math.exp((2.0 - 2.0 * k) * alpha)
    large = _sinhc_less_one(2.0 * k * alpha)
    return (large - _sinhc_less_one(2.0 * alpha)) / (1.0 + large)


@njit(cache=True)
def _sinhc_less_one(x):
    """sinh(x) / x - 1 for x up to 1, by Taylor's series to full precision."""
    square = x * x
    value = 0.0
    for j in range(8, 0, -1):
        value = square / (2.0 * j * (2.0 * j + 1.0)) * (1.0 + value)
    return value
