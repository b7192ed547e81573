"""How the periodic Rotne-Prager sum is split into pairs and waves, and how well.

The tensor of all images is the sum over waves k of

    6 pi a / (L^3 k^2) sinc(k a)^2 (1 - k k / k^2) exp(i k r),

in units of an isolated sphere's mobility. Its smooth part has the factor H(k b), from a
Kaiser-Bessel window of radius b and steepness beta, and ends at k = beta / b:

    H = psi - kappa psi' / 2,  psi(kappa) = beta sinh(s) / (s sinh(beta)),  s^2 = beta^2 - kappa^2.

Without the end, psi is the transform of a window that vanishes beyond b, so the rest of the tensor
vanishes beyond b + 2 a (Hasimoto's splitting by such a window: Nestler, Pippig & Potts 2015,
J. Comput. Phys. 285, 280; Liang et al. 2025 for prolate functions). The rest is the tensor of a
pair in unbounded fluid minus the smooth part's, which is found with the same end and so has no
error of its own within its reach.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.fft import next_fast_len

from dustfall.suspension.rotne_prager import pair_coefficients
from dustfall.suspension.window import window_steepness, window_transform
from dustfall.units import RADIUS

NEIGHBOURS = 33
"""Particles within reach of one, on average: pairs and waves then take about the same time."""

SMALLEST_REACH = 2.0
"""Of the pairs [d_p]: below, the window would be narrower than a sphere, and waves many."""

POINTS = (4, 8, 12)
"""Of the windows: numbers whose loops fill vector registers."""

OVERSAMPLING = (1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2.0)
"""Grid points over those that the waves need; beyond two the windows gain nothing."""

GRID_POINT_COST = 12.0
"""Time of a grid point in the Fourier transforms, over that of a window's point."""

PAIRS_SHARE, WAVES_SHARE = 0.3, 0.5
"""Of the tolerance that the errors of pairs and waves may take; steeper windows cost less than
finer grids. The rest is for spheres that are not random."""

FEW = 400
"""Spheres that may well stand in one lump, where errors add up: so many and fewer may have half of
these shares and less, which costs little for them."""

WAVES = 12
"""Along an axis, that the error of a grid is summed over at most."""

SINGLE_PRECISION = 1e-5
"""Tolerance from which on single precision is enough: its rounding makes errors of 1e-6."""

SMALLEST_TOLERANCE, LARGEST_TOLERANCE = 1e-8, 0.1

STEEPNESS, STEEPNESS_STEP = (2.0, 66.0), 0.125
"""Range of the search for a window, and how finely it ends."""

_NODES = 128  # of Gauss-Legendre rules over wavenumbers: enough for k r up to 100
_SERIES_BELOW = 0.05  # of the Bessel functions: three terms are exact there, and closed forms not
_RADII = 80  # of the sums over the distance behind the reach


def smooth_factor(kappa, steepness: float) -> np.ndarray:
    """H, for kappa from 0 to the steepness beta."""
    root = np.sqrt(np.maximum(steepness**2 - np.asarray(kappa) ** 2, 0.0))
    # Times 2 exp(-beta), which keeps hyperbolic functions of a steep window finite.
    decay = 2 * np.exp(root - steepness) / -np.expm1(-2 * steepness)
    odd = np.where(root > 0, -np.expm1(-2 * root) / np.maximum(2 * root, 1e-300), 1.0)
    even = (1 + np.exp(-2 * root)) / 2
    small = root < 0.01
    bracket = np.where(
        small, (1 + root**2 / 10) / 3, (even - odd) / np.where(small, 1.0, root) ** 2
    )
    return steepness * decay * (odd + np.asarray(kappa) ** 2 / 2 * bracket)


@dataclass(frozen=True)
class Splitting:
    """One way to share the sum between pairs and waves.

    Attributes
    ----------
    side : of the cube [d_p]
    reach : of the pairs [d_p]
    radius : b of the window that splits [d_p]
    steepness : beta of that window
    points : of the window that takes forces to the grid, in each direction
    grid : points of the grid along a side
    single : whether the numbers have single precision
    tolerance : that all this is for
    """

    side: float
    reach: float
    radius: float
    steepness: float
    points: int
    grid: int
    single: bool
    tolerance: float

    @property
    def dtype(self):
        return np.float32 if self.single else np.float64

    @property
    def last_wavenumber(self) -> float:
        return self.steepness / self.radius

    @property
    def window_steepness(self) -> float:
        """Of the window that takes forces to the grid."""
        oversampling = self.grid * np.pi / self.side / self.last_wavenumber
        return window_steepness(self.points, oversampling)

    @cached_property
    def wavenumbers(self) -> tuple[np.ndarray, np.ndarray]:
        """Along an axis of the grid (M,), and along the one that real transforms halve."""
        unit = 2 * np.pi / self.side
        whole = unit * np.fft.fftfreq(self.grid, 1 / self.grid)
        return whole, unit * np.arange(self.grid // 2 + 1)

    @cached_property
    def influence(self) -> np.ndarray:
        """Factor (M, M, M // 2 + 1) from forces' waves to the velocities', windows divided out."""
        whole, half = self.wavenumbers
        spacing = self.side / self.grid
        windows = [
            window_transform(k * spacing, self.points, self.window_steepness) ** -2.0
            for k in (whole, half)
        ]
        square = whole**2
        factor = np.empty((self.grid, self.grid, len(half)), self.dtype)
        for i in range(self.grid):
            k = np.sqrt(square[i] + square[:, None] + half**2)
            k[k > self.last_wavenumber] = 0.0
            plane = windows[0][i] * windows[0][:, None] * windows[1] / self.side**3
            factor[i] = plane * _wave(k, self.radius, self.steepness)
        return factor

    @cached_property
    def smooth_pairs(self) -> np.ndarray:
        """The smooth part (m, 2) of a pair, across and along, at equal steps up to the reach.

        Steps are so short that cubic interpolation, off by 3/128 (k h)^4 for a wave k, has a
        thousandth of the tolerance.
        """
        step = (0.001 * self.tolerance * 128 / 3) ** 0.25 / self.last_wavenumber
        r = np.linspace(0.0, self.reach, int(np.ceil(self.reach / step)) + 4)
        return np.stack(_smooth_pair(r, self.radius, self.steepness), axis=1)


@lru_cache(maxsize=32)
def choose_splitting(
    particles: int,
    side: float,
    tolerance: float,
    crowding: float = 1.0,
    reach: float | None = None,
) -> Splitting:
    """Choose the cheapest splitting that keeps the tolerance.

    The error is that of the velocities, root mean square over the particles, over the forces'.
    It has four parts. For random forces the pairs beyond reach add up to the square root of the
    density's integral of the squared rest of the tensor, for equal forces to its mean; the aliases
    of the grid are summed in the same way over waves, for the other particles and for the particle
    itself.

    Parameters
    ----------
    particles, side : n, and the cube's side [d_p]
    tolerance : relative error of velocities, 1e-8 to 0.1
    crowding : density around a particle over the mean density
    reach : of the pairs [d_p], by default one with which pairs take as long as waves

    Raises
    ------
    ValueError : the tolerance is out of range.
    """
    if not SMALLEST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE:
        raise ValueError(
            f"tolerance is {tolerance}: allowed are {SMALLEST_TOLERANCE} to {LARGEST_TOLERANCE}"
        )
    mean_density = particles / side**3
    density = crowding * mean_density
    allowed = tolerance * particles / (particles + FEW)
    if reach is None:
        # Where particles crowd, fewer of the mean density and more of the crowd balance the sums.
        between = np.sqrt(density * mean_density)
        reach = (3 * NEIGHBOURS / (4 * np.pi * between)) ** (1 / 3)
    reach = float(max(reach, SMALLEST_REACH))
    radius, steepness = _window_for_reach(reach, density, PAIRS_SHARE * allowed)
    choices = []
    for points in POINTS:
        for oversampling in OVERSAMPLING:
            least = oversampling * steepness / radius * side / np.pi
            grid = 2 * next_fast_len(int(np.ceil(max(least / 2, points))), real=True)
            true = grid * np.pi / side * radius / steepness
            error = _aliases(points, true, radius, steepness, density, side)
            if error <= WAVES_SHARE * allowed:
                cost = particles * points**3 + GRID_POINT_COST * grid**3
                choices.append((cost, points, grid))
                break
    _, points, grid = min(choices)
    single = tolerance >= SINGLE_PRECISION
    return Splitting(side, reach, radius, steepness, points, grid, single, tolerance)


def splitting_with_waves(
    particles: int, side: float, tolerance: float, wavenumber: float, points: int
) -> Splitting:
    """Choose a splitting whose smooth part has all waves up to a wavenumber [1/d_p].

    As far as a grid of so many points in all allows; raises ValueError as `choose_splitting`.
    """
    splitting = choose_splitting(particles, side, tolerance)
    while splitting.last_wavenumber < wavenumber and splitting.reach > SMALLEST_REACH:
        reach = splitting.reach * max(splitting.last_wavenumber / wavenumber, 0.9) * 0.99
        finer = choose_splitting(particles, side, tolerance, reach=reach)
        if finer.grid**3 > points:
            break
        splitting = finer
    return splitting


def _window_for_reach(reach, density, allowed):
    """Radius and steepness of fewest waves whose pairs beyond reach add up to no more."""
    choices = []
    for less in np.linspace(0.0, 2 * RADIUS, 5):
        radius = float(reach - less)
        low, high = STEEPNESS
        while high - low > STEEPNESS_STEP:
            middle = (low + high) / 2
            if _beyond_reach(reach, radius, middle, density) > allowed:
                low = middle
            else:
                high = middle
        choices.append((high / radius, radius, high))
    return min(choices)[1:]


def _beyond_reach(reach, radius, steepness, density):
    r = np.linspace(reach, 2 * reach, _RADII)
    across, along = np.array([pair_coefficients(distance) for distance in r]).T
    smooth_across, smooth_along = _smooth_pair(r, radius, steepness)
    across, along = across - smooth_across, along - smooth_along
    shell = density * 4 * np.pi * r**2
    square = np.trapezoid(shell * (2 * across**2 + (across + along) ** 2) / 3, r)
    mean = np.trapezoid(shell * (across + along / 3), r)
    return np.hypot(np.sqrt(square), mean)


def _aliases(points, oversampling, radius, steepness, density, side):
    """Error by the aliases of the grid: a sum over the waves of the cube, or of a smaller one."""
    last = steepness / radius
    unit = max(2 * np.pi / side, last / WAVES)
    k = unit * np.arange(int(last / unit) + 1)
    shape = window_steepness(points, oversampling)
    angle = k / last * np.pi / oversampling
    alias = np.stack(
        [window_transform(angle + 2 * np.pi * m, points, shape) for m in (-2, -1, 1, 2)]
    )
    alias = np.abs(alias / window_transform(angle, points, shape))
    # One of eight octants; waves in its faces belong to half as many octants.
    octants = np.where(k > 0, 2.0, 1.0)
    square = (k**2)[:, None, None] + (k**2)[:, None] + k**2
    inside = square <= last**2
    wave = np.where(inside, _wave(np.sqrt(square), radius, steepness), 0.0)
    octants = octants[:, None, None] * octants[:, None] * octants
    wave_alias = wave * octants * (unit / 2 / np.pi) ** 3
    # Two thirds of a wave are transverse; three directions have aliases; two windows, there and
    # back, have them independently where the particles differ, and together for one particle.
    first = wave_alias.sum(axis=(1, 2))
    second = (wave_alias * wave).sum(axis=(1, 2))
    others = 4 * density * second @ (alias**2).sum(axis=0)
    itself = 4 * first @ alias.sum(axis=0)
    return np.hypot(np.sqrt(others), itself / 2)


def _wave(k, radius, steepness):
    """The smooth part of a wave, times the volume; zero at k = 0."""
    square = np.where(k > 0, k, np.inf) ** 2
    sphere = np.sinc(k * RADIUS / np.pi) ** 2
    return 6 * np.pi * RADIUS / square * sphere * smooth_factor(k * radius, steepness)


def _smooth_pair(r, radius, steepness):
    """Coefficients across and along of the smooth part in unbounded fluid, (m,) each.

    The integral of the waves over directions leaves spherical Bessel functions.
    """
    node, weight = np.polynomial.legendre.leggauss(_NODES)
    k = (node + 1) / 2 * steepness / radius
    strength = weight / 2 * steepness / radius * _wave(k, radius, steepness) * k**2
    strength /= 2 * np.pi**2
    x = np.outer(r, k)
    square = x**2
    few = x < _SERIES_BELOW
    x[few] = 1.0
    j0 = np.sin(x) / x
    j2 = 3 * (j0 - np.cos(x)) / x**2 - j0
    small = square[few]
    j0[few] = 1 - small / 6 * (1 - small / 20 * (1 - small / 42))
    j2[few] = small / 15 * (1 - small / 14 * (1 - small / 36))
    return (2 * j0 - j2) / 3 @ strength, j2 @ strength
