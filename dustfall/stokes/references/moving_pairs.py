"""Two spheres of any radii that move in any way: exact resistance, from narrow gaps to far apart.

In bispherical coordinates (xi, eta) both spheres are coordinate surfaces, xi = xi_1 > 0 and
xi = -xi_2 < 0. The flow is u = r p / 2 + v with harmonic p, v_x, v_y, v_z (Dean and O'Neill 1963;
Lee and Leal 1980), each a series of

    sqrt(cosh xi - cos eta) exp(+-(n + 1/2) xi) P_n^m(cos eta),  P_n^m = sin^m d^m P_n / d cos^m;

the upper sign is singular inside the first sphere, the lower inside the second. For a motion that
goes round the axis as cos(m phi) these are p and w = v_z of order m, and v_rho + v_phi and
v_rho - v_phi, of orders m + 1 and m - 1 (called "above" and "below"). No slip and div u = 0 tie
neighbouring degrees n: a banded system for each m. Its conditioning is made good by refinement with
residuals of extended precision.

Lengths inside this module are in d_p, viscosity is 1.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu

from dustfall.spheres import (
    checked_centres,
    checked_flow,
    checked_gradient,
    checked_radii,
    checked_vectors,
)
from dustfall.units import RADIUS

SMALLEST_GAP, LARGEST_GAP = 1e-6, 1e4
"""Gaps over the smaller radius that are allowed."""

LARGEST_RATIO = 100.0
"""Of the radii."""

NEGLIGIBLE = 1e-12
"""Degrees are taken in until a sphere's terms have decayed to this on the plane xi = 0; the loads
are products of two such terms, off by a part of 1e-15 or less."""

FEWEST_DEGREES, MOST_DEGREES = 24, 60_000
"""The most take ten seconds of a core and 1 GB."""

REFINEMENTS = 2
"""Each multiplies the error by 1e-16 times the condition number, 1e6 at a gap of 1e-4 d_p."""

EXTENDED = np.longdouble
"""Residuals are formed in it. Where it is no longer than double, gaps below 1e-3 d_p lose digits:
1e-10 is left at 1e-4 d_p, as without refinement."""

HALF, PI, ROOT = EXTENDED(1) / 2, 4 * np.arctan(EXTENDED(1)), np.sqrt(EXTENDED(2))


@dataclass(frozen=True)
class PairResistance:
    """What two spheres exert on the fluid for what they do; z is from the second to the first.

    Rows and columns are those of the first sphere, then those of the second; each sphere turns and
    strains about its own centre. Rows times the work of their load (1 for a force, 1/3 for a
    torque, 1/2, 2/3 and 2/3 for stresslets zz, xz and xx = -yy) give symmetric matrices.

    Attributes
    ----------
    along : (4, 4), force z and stresslet zz for velocity z and strain diag(-1/2, -1/2, 1)
    about : (2, 2), torque z for angular velocity z
    across : (6, 6), force x, torque y and stresslet xz for velocity x, angular velocity y, strain
        xz = zx = 1
    planar : (2, 2), stresslet xx = -yy for strain xx = -yy = 1

    Units: force 3 pi mu d_p U, torque and stresslet pi mu d_p^2 U, angular velocity and strain
    U / d_p: a sphere of diameter 1 alone has 1, 1 and 5/6 on the diagonals.
    """

    along: np.ndarray
    about: np.ndarray
    across: np.ndarray
    planar: np.ndarray


@dataclass(frozen=True)
class Loads:
    """What the fluid exerts on both spheres: force (2, 3), torque (2, 3), stresslet (2, 3, 3).

    Units as in `PairResistance`; torque and stresslet are about the spheres' own centres.
    """

    force: np.ndarray
    torque: np.ndarray
    stresslet: np.ndarray


def pair_resistance(gap: float, radii=(RADIUS, RADIUS)) -> PairResistance:
    """Resistance of two spheres, 1e-10 or better of each diagonal from gaps of 1e-4 d_p on.

    gap: between the surfaces [d_p]. radii: of the first and the second sphere [d_p]. What is given
    as a gap is exact; a distance near contact is not. The number of degrees, and so the time, grows
    as larger radius / sqrt(gap x smaller radius): below a second for equal spheres at 1e-4 d_p.
    Raises ValueError for radii that are not two positive numbers within LARGEST_RATIO of each
    other, for gaps outside SMALLEST_GAP to LARGEST_GAP, both over the smaller radius, and where
    more than MOST_DEGREES would be needed.
    """
    radii = checked_radii(radii, 2)
    if radii.max() > LARGEST_RATIO * radii.min():
        raise ValueError(f"radii {radii.tolist()}: their ratio may be {LARGEST_RATIO:g} at most")
    if not SMALLEST_GAP <= gap / radii.min() <= LARGEST_GAP:
        raise ValueError(
            f"gap {gap:.6g} d_p: allowed are {SMALLEST_GAP:g} to {LARGEST_GAP:g} smaller radii, "
            f"here {SMALLEST_GAP * radii.min():g} to {LARGEST_GAP * radii.min():g} d_p"
        )
    pair = _Pair(gap, radii)
    if len(pair.n) > MOST_DEGREES:
        raise ValueError(
            f"gap {gap:.6g} d_p of radii {radii.tolist()}: {len(pair.n)} degrees are needed, at "
            f"most {MOST_DEGREES} are allowed; wider gaps and radii more alike need fewer"
        )
    along, across, planar = (_resistance(pair, m) for m in range(3))
    return PairResistance(along, _torsion(pair), across, planar)


def loads_on_two_spheres(
    centres, velocity, angular_velocity=None, flow=(0.0, 0.0, 0.0), gradient=None, radii=None
) -> Loads:
    """Exact loads on two spheres that translate and turn in a flow that is `flow + gradient @ x`.

    centres: (2, 3) [d_p]. velocity: (2, 3). angular_velocity: (2, 3), default 0. flow: (3,).
    gradient: (3, 3) without trace, default 0. radii: (2,) [d_p], default 0.5.
    Raises ValueError for other shapes, numbers that are not finite, a gradient with a trace, and
    what `pair_resistance` refuses.
    """
    radii = checked_radii(radii, 2)
    centres = checked_centres(centres, radii)
    if len(centres) != 2:
        raise ValueError(f"centres must have the shape (2, 3), not {centres.shape}")
    gradient = checked_gradient(gradient)
    line = centres[0] - centres[1]
    distance = np.linalg.norm(line)
    resistance = pair_resistance(distance - radii.sum(), radii)

    spin = 0.5 * np.array([gradient[k - 1, k - 2] - gradient[k - 2, k - 1] for k in range(3)])
    turning = checked_vectors("angular_velocity", angular_velocity, 2) - spin
    moving = checked_vectors("velocity", velocity, 2) - checked_flow(flow) - centres @ gradient.T
    frame = _frame(line / distance)
    moving, turning = moving @ frame.T, turning @ frame.T
    strain = -frame @ (0.5 * (gradient + gradient.T)) @ frame.T

    force, torque, stresslet = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3, 3))
    motion = np.stack([moving[:, 2], np.full(2, strain[2, 2])], 1)
    pull = (resistance.along @ motion.ravel()).reshape(2, 2)
    force[:, 2] = pull[:, 0]
    stresslet += pull[:, 1, None, None] * np.diag([-0.5, -0.5, 1.0])
    torque[:, 2] = resistance.about @ turning[:, 2]
    # What is across along y is what is along x, turned by a right angle: y for x and -x for y.
    for a, b, sense in ((0, 1, 1.0), (1, 0, -1.0)):
        motion = np.stack([moving[:, a], sense * turning[:, b], np.full(2, strain[a, 2])], 1)
        pull = (resistance.across @ motion.ravel()).reshape(2, 3)
        force[:, a] = pull[:, 0]
        torque[:, b] = sense * pull[:, 1]
        stresslet[:, a, 2] = stresslet[:, 2, a] = pull[:, 2]
    total = resistance.planar.sum(axis=1)
    planar = 0.5 * (strain[0, 0] - strain[1, 1])
    stresslet += total[:, None, None] * np.array(
        [[planar, strain[0, 1], 0.0], [strain[0, 1], -planar, 0.0], [0.0, 0.0, 0.0]]
    )
    return Loads(-force @ frame, -torque @ frame, -frame.T @ stresslet @ frame)


def _frame(line):
    """A right-handed orthonormal frame (3, 3), in rows, of which the last is `line`."""
    first = np.cross(line, np.eye(3)[np.abs(line).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(line, first), line])


class _Pair:
    """Bispherical coordinates of two spheres, in extended precision, without cancellation.

    The foci are at z = +-c; c = a b sinh(xi_1 + xi_2) / (a + b + gap) and
    cosh(xi_1 + xi_2) - 1 = gap (gap + 2 a + 2 b) / (2 a b).

    Attributes
    ----------
    c, xi, n : half the distance of the foci, |xi| of both spheres, all degrees
    decay : exp(-(n + 1/2) xi) for both: of a sphere's term, from its surface to the plane xi = 0
    beyond : coth(xi) - 1 for both: a centre is c coth(xi) from the plane
    """

    side = 1, -1
    """Sign of xi, of each sphere."""

    def __init__(self, gap, radii):
        gap, (a, b) = EXTENDED(gap), radii.astype(EXTENDED)
        excess = gap * (gap + 2 * (a + b)) / (2 * a * b)
        both = np.log1p(excess + np.sqrt(excess * (excess + 2)))
        self.c = a * b * np.sinh(both) / (a + b + gap)
        self.xi = np.arcsinh(self.c / a), np.arcsinh(self.c / b)
        degrees = int(-np.log(NEGLIGIBLE) / min(self.xi)) + FEWEST_DEGREES
        self.n = np.arange(degrees, dtype=EXTENDED)
        self.decay = [np.exp(-(self.n + HALF) * xi) for xi in self.xi]
        self.beyond = [2 / np.expm1(2 * xi) for xi in self.xi]


def _resistance(pair: _Pair, m: int) -> np.ndarray:
    """What both spheres exert for their motions that go round the axis as cos(m phi)."""
    fields = ("p", "w", "above", "below") if m else ("p", "w", "above")
    columns = {(f, s): 2 * i + s for i, f in enumerate(fields) for s in (0, 1)}
    orders = {"p": m, "w": m, "above": m + 1, "below": m - 1}
    exists = np.stack([pair.n >= orders[f] for f, _ in columns], axis=1)

    motions = [motion for sphere in (0, 1) for motion in _motions(pair, m, sphere)]
    right = np.zeros((*exists.shape, len(motions)), EXTENDED)
    for k, (sphere, velocity) in enumerate(motions):
        for field, series in velocity.items():
            order = orders[field]
            series = np.where(pair.n >= order, series * pair.decay[sphere], 0)
            for shift, factor in _times_gap(pair, order, sphere):
                right[:, columns[field, sphere], k] += factor * _shifted(series, shift)
    right *= exists[:, :, None]

    terms = [
        (columns[row], columns[column], shift, factor * exists[:, columns[row]])
        for row, column, shift, factor in (*_no_slip(pair, m), *_no_divergence(pair, m))
        if column in columns and row in columns
    ]
    solved = _solved(terms, exists, right)
    loads = []
    for sphere in (0, 1):
        series = {f: solved[:, columns[f, sphere]] * pair.decay[sphere][:, None] for f in fields}
        loads += _loads(pair, m, sphere, series)
    return np.array(loads, float)


def _motions(pair, m, sphere):
    """The sphere and its velocity in each of its motions: series of fields, without `decay`.

    1, z - z(centre) and rho are series of P_n, P_n and P_n^1 that are regular in the sphere; on the
    axis they follow from that of 1 / |r - r'|.
    """
    one = ROOT * np.ones_like(pair.n)
    height = pair.side[sphere] * pair.c * ROOT * (2 * pair.n - pair.beyond[sphere])
    rho = 2 * ROOT * pair.c * np.ones_like(pair.n)
    motions = {
        0: [{"w": one}, {"w": height, "above": -rho}],
        1: [{"below": 2 * one}, {"below": 2 * height, "w": -rho}, {"below": 2 * height, "w": rho}],
        2: [{"below": 2 * rho}],
    }
    return [(sphere, motion) for motion in motions[m]]


def _times_gap(pair, order, sphere):
    """A series of P_n^order on a sphere, times cosh xi - cos eta: shifts in n and factors."""
    n = pair.n
    yield 0, np.cosh(pair.xi[sphere]) * np.ones_like(n)
    yield -1, -(n - order) / (2 * n - 1)
    yield 1, -(n + 1 + order) / (2 * n + 3)


def _no_slip(pair, m):
    """r p / 2 + v on both spheres, times (cosh xi - cos eta)^(1/2), each degree of each field."""
    n, c = pair.n, pair.c
    # v_rho alone stands for m = 0, which is half of "above".
    rho = c if m == 0 else c / 2
    for sphere in (0, 1):
        z = pair.side[sphere] * c * np.sinh(pair.xi[sphere]) / 2
        for source in (0, 1):
            reach = 0 if source == sphere else pair.xi[0] + pair.xi[1]
            coupling = [
                ("w", "p", 0, z * np.ones_like(n)),
                ("above", "p", -1, rho / (2 * n - 1)),
                ("above", "p", 1, -rho / (2 * n + 3)),
                ("below", "p", -1, -rho * (n - m) * (n - m + 1) / (2 * n - 1)),
                ("below", "p", 1, rho * (n + m) * (n + m + 1) / (2 * n + 3)),
            ]
            for field, order in (("w", m), ("above", m + 1), ("below", m - 1)):
                coupling += [(field, field, *term) for term in _times_gap(pair, order, sphere)]
            for row, column, shift, factor in coupling:
                seen = np.exp(-(n + shift + HALF) * reach)
                yield (row, sphere), (column, source), shift, factor * seen


def _no_divergence(pair, m):
    """5 p + ... = 0: the part of 2 div u that is singular in each sphere, times c."""
    n = pair.n
    for sphere in (0, 1):
        side, c = pair.side[sphere], pair.c
        equation = {
            ("p", 0): 5 * c * np.ones_like(n),
            ("p", 1): c * (n + m + 1),
            ("p", -1): -c * (n - m),
            ("w", 0): 2 * side * (2 * n + 1),
            ("w", 1): -2 * side * (n + m + 1),
            ("w", -1): -2 * side * (n - m),
            ("above", 0): -2 * (n + m + 1) * (n - m),
            ("above", 1): (n + m + 2) * (n + m + 1),
            ("above", -1): (n - m) * (n - m - 1),
            ("below", 0): 2 * np.ones_like(n),
            ("below", 1): -np.ones_like(n),
            ("below", -1): -np.ones_like(n),
        }
        for (field, shift), factor in equation.items():
            yield ("p", sphere), (field, sphere), shift, factor * np.exp(-shift * pair.xi[sphere])


def _shifted(series, shift):
    """series[n + shift] in place n, zero beyond both ends."""
    moved = np.zeros_like(series)
    if shift > 0:
        moved[:-shift] = series[shift:]
    elif shift < 0:
        moved[-shift:] = series[:shift]
    else:
        moved = series
    return moved


def _solved(terms, exists, right):
    """Solution (degrees, columns, motions) of the banded system, refined in extended precision."""
    degrees = len(exists)
    number = np.where(exists, exists.ravel().cumsum().reshape(exists.shape) - 1, -1)
    entries = []
    for row, column, shift, factor in terms:
        n = np.arange(max(0, -shift), min(degrees, degrees - shift))
        kept = n[exists[n, row] & exists[n + shift, column]]
        entries.append(
            (number[kept, row], number[kept + shift, column], factor[kept].astype(float))
        )
    rows, columns, values = map(np.concatenate, zip(*entries, strict=True))
    factored = splu(coo_array((values, (rows, columns))).tocsc(), permc_spec="NATURAL")

    def solve(right):
        # Right-hand sides of all sizes have to pass through double precision.
        size = np.maximum(np.abs(right).max(axis=(0, 1)), np.finfo(float).tiny)
        found = np.zeros_like(right)
        found[exists] = size * factored.solve((right[exists] / size).astype(float))
        return found

    solution = solve(right)
    for _ in range(REFINEMENTS):
        residual = right.copy()
        for row, column, shift, factor in terms:
            residual[:, row] -= factor[:, None] * _shifted(solution[:, column], shift)
        solution += solve(residual)
    return solution


def _loads(pair, m, sphere, series):
    """Force, torque and stresslet on the fluid by a sphere, in this order where m has them.

    Outside, the part that is singular in a sphere is that of a force, p = F.r / 4 pi r^3 and
    v = F / 8 pi r, a torque, v = T x r / 8 pi r^3, and a stresslet, p = 3 S:rr / 4 pi r^5, and what
    falls off faster. Its moment with a regular harmonic about the centre is the sum of products of
    both series, times c for m = 0 and c (n + m)! / 2 (n - m)! otherwise (Green's second identity).
    """
    n, c, beyond = pair.n[:, None], pair.c, pair.beyond[sphere]
    side = pair.side[sphere]
    height = side * c * c * ROOT * (2 * n - beyond)
    if m == 0:
        p2 = c**3 * ROOT * (2 * n * (n - 1) - 4 * n * beyond + beyond**2)
        force = 4 * PI * (height * series["p"]).sum(axis=0)
        stresslet = 4 * PI / 3 * (p2 * series["p"]).sum(axis=0)
        return [force / (3 * PI), stresslet / PI]
    if m == 1:
        rho = c * c * ROOT * n * (n + 1)
        rho_z = side * c**3 * ROOT * n * (n + 1) * ((2 * n - 2) / 3 - beyond)
        force = 4 * PI * (rho * series["p"]).sum(axis=0)
        torque = 4 * PI * (height * series["below"]).sum(axis=0)
        stresslet = 2 * PI * (rho_z * series["p"]).sum(axis=0)
        return [force / (3 * PI), torque / PI, stresslet / PI]
    rho_rho = c**3 * ROOT * 2 / 3 * (n + 2) * (n + 1) * n * (n - 1)
    return [PI * (rho_rho * series["p"]).sum(axis=0) / PI]


def _torsion(pair: _Pair) -> np.ndarray:
    """Torques along z for angular velocities along z, where p = 0 and each degree is by itself."""
    n, c = pair.n, pair.c
    rho = 2 * ROOT * c
    torque = np.zeros((2, 2))
    for turning, decay in enumerate(pair.decay):
        other = pair.decay[1 - turning]
        # v_phi is rho on the sphere that turns and 0 on the other.
        own = rho * decay / (1 - (decay * other) ** 2)
        induced = -own * decay * other
        for sphere, series in ((turning, own), (1 - turning, induced)):
            moment = (c * c * ROOT * n * (n + 1) * series * pair.decay[sphere]).sum()
            torque[sphere, turning] = 8 * moment
    return torque
