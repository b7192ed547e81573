"""Stokesian dynamics: force, torque and stresslet of each sphere, and the lubrication of pairs.

The peer method of the benchmark (Durlofsky, Brady and Bossis 1987; Brady and Bossis 1988). The
grand mobility of equal spheres in the multipoles F, T, S is inverted, and what the inverse then
lacks in a pair is added for each close one: the exact resistance of two spheres less that which the
mobility of these two alone has.

A sphere's motion is a velocity (3,) and the gradient of its surface's velocity, its loads on the
fluid a force (3,) and the first moment of the traction: eleven numbers in a basis of matrices
without trace. Lengths are in d_p, viscosity is 1.
"""

from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from dustfall.stokes.references.moving_pairs import pair_resistance
from dustfall.units import RADIUS

REACH = 1.0
"""Gap [d_p] up to which pairs are corrected: four radii from centre to centre, as is usual."""

SMALLEST_GAP = 1e-3
"""Gap [d_p] from which on pairs are corrected."""

GAPS = 48
"""Of the table of corrections, in geometric progression."""


def _unit(*places):
    """Matrix (3, 3) with the given (row, column, value)."""
    matrix = np.zeros((3, 3))
    for row, column, value in places:
        matrix[row, column] = value
    return matrix


# Modes of a sphere of a pair along z: its matrix in `PairResistance` and the row there, its motion,
# a velocity along an axis or a gradient of the velocity, and the moment of traction of a unit load.
_MODES: list[tuple[str, int, int | np.ndarray, float]] = [
    ("along", 0, 2, 3.0 * np.pi),
    ("along", 1, np.diag([-0.5, -0.5, 1.0]), np.pi),
    ("about", 0, _unit((0, 1, -1), (1, 0, 1)), 0.5 * np.pi),
    ("x", 0, 0, 3.0 * np.pi),
    ("x", 1, _unit((0, 2, 1), (2, 0, -1)), 0.5 * np.pi),
    ("x", 2, _unit((0, 2, 1), (2, 0, 1)), np.pi),
    ("y", 0, 1, 3.0 * np.pi),
    ("y", 1, _unit((1, 2, 1), (2, 1, -1)), 0.5 * np.pi),
    ("y", 2, _unit((1, 2, 1), (2, 1, 1)), np.pi),
    ("planar", 0, np.diag([1.0, -1.0, 0.0]), np.pi),
    ("oblique", 0, _unit((0, 1, 1), (1, 0, 1)), np.pi),
]
_MATRICES = {"x": "across", "y": "across", "oblique": "planar"}

BASIS = np.array([motion for _, _, motion, _ in _MODES if isinstance(motion, np.ndarray)])
BASIS /= np.sqrt((BASIS**2).sum(axis=(1, 2), keepdims=True))
"""Orthonormal matrices without trace (8, 3, 3)."""

_RESPONSE = np.where(
    (BASIS + BASIS.transpose(0, 2, 1)).any(axis=(1, 2)), 20.0 / 3.0 * np.pi, 4.0 * np.pi
)
"""Moment of the traction over the gradient of a lone sphere of radius 1: strain, rotation."""


def stokesian_dynamics(centres, velocity, angular_velocity) -> np.ndarray:
    """Force (n, 3) [3 pi mu d_p U] on equal spheres that translate and turn in fluid at rest.

    centres [d_p], velocity [U], angular_velocity [U / d_p]: (n, 3).
    """
    n = len(centres)
    turning = -np.einsum("klm,nm->nkl", _LEVI_CIVITA, angular_velocity)
    gradients = np.einsum("qkl,nkl->nq", BASIS, turning)
    motion = np.concatenate([velocity, gradients], axis=1)
    loads = np.linalg.solve(_mobility(centres), motion.ravel()).reshape(n, 11)
    for i in range(n):
        for j in range(i):
            line = centres[i] - centres[j]
            distance = float(np.linalg.norm(line))
            gap = distance - 2.0 * RADIUS
            if gap < REACH:
                turn = _turned(line / distance)
                pair = np.concatenate([turn @ motion[i], turn @ motion[j]])
                added = _correction()(np.log(max(gap, SMALLEST_GAP))) @ pair
                loads[i] += turn.T @ added[:11]
                loads[j] += turn.T @ added[11:]
    return -loads[:, :3] / (3.0 * np.pi)


_LEVI_CIVITA = np.array(
    [[[(i - j) * (j - k) * (k - i) / 2.0 for k in range(3)] for j in range(3)] for i in range(3)]
)


def _mobility(centres) -> np.ndarray:
    """Grand mobility (11 n, 11 n) of loads on the fluid, by Faxen's laws (Kim and Karrila 1991)."""
    n, square = len(centres), RADIUS**2
    own = np.eye(11)
    own[:3] /= 6.0 * np.pi * RADIUS
    own[3:] /= RADIUS**3 * _RESPONSE[:, None]
    mobility = np.zeros((n, n, 11, 11))
    mobility[np.arange(n), np.arange(n)] = own
    i, j = np.nonzero(~np.eye(n, dtype=bool))
    away = centres[i] - centres[j]
    block = np.empty((len(i), 11, 11))
    block[:, :3, :3] = _flow(away, square / 3.0)[0]
    gradient = _flow(away, 4.0 / 15.0 * square)[1]
    block[:, :3, 3:] = -np.einsum("mijk,qjk->miq", gradient, BASIS)
    block[:, 3:, :3] = np.einsum("mijl,qil->mqj", gradient, BASIS)
    second = _flow(away, square / 5.0)[2]
    half = np.einsum("mijkl,pjk->mipl", second, BASIS)
    block[:, 3:, 3:] = -np.einsum("mipl,qil->mqp", half, BASIS)
    mobility[i, j] = block
    return mobility.transpose(0, 2, 1, 3).reshape(11 * n, 11 * n)


def _flow(away, spread):
    """(1 + spread Laplacian) of the Stokeslet G_ij at `away` (m, 3), and its first two gradients.

    (m, 3, 3), (m, 3, 3, 3) and (m, 3, 3, 3, 3): derivatives come last.
    """
    one = np.eye(3)
    r = np.linalg.norm(away, axis=1)
    # G = f 1 + g r r; then derivatives of f and g, each over r.
    f, f1, f2 = (
        1.0 / r + 2.0 * spread / r**3,
        -1.0 / r**3 - 6.0 * spread / r**5,
        3.0 / r**5 + 30.0 * spread / r**7,
    )
    g, g1, g2 = (
        1.0 / r**3 - 6.0 * spread / r**5,
        -3.0 / r**5 + 30.0 * spread / r**7,
        15.0 / r**7 - 210.0 * spread / r**9,
    )
    dyad = away[:, :, None] * away[:, None, :]
    tensor = np.einsum("m,ij->mij", f, one) + g[:, None, None] * dyad
    first = np.einsum("m,mk,ij->mijk", f1, away, one) + np.einsum("m,mij,mk->mijk", g1, dyad, away)
    first += np.einsum("m,ik,mj->mijk", g, one, away) + np.einsum("m,jk,mi->mijk", g, one, away)
    second = np.einsum("m,kl,ij->mijkl", f1, one, one) + np.einsum("m,mkl,ij->mijkl", f2, dyad, one)
    second += np.einsum("m,mij,mkl->mijkl", g2, dyad, dyad)
    for places in ("ik,jl", "jk,il"):
        second += np.einsum(f"m,{places}->mijkl", g, one, one)
    for places in ("ik,mjl", "jk,mil", "kl,mij", "il,mjk", "jl,mik"):
        second += np.einsum(f"m,{places}->mijkl", g1, one, dyad)
    return tensor / (8.0 * np.pi), first / (8.0 * np.pi), second / (8.0 * np.pi)


def _turned(line):
    """Motions and loads (11, 11) as seen in a frame of which the z axis is `line`."""
    first = np.cross(line, np.eye(3)[np.abs(line).argmin()])
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(line, first), line])
    turn = np.zeros((11, 11))
    turn[:3, :3] = frame
    turn[3:, 3:] = np.einsum("qkl,ka,lb,pab->qp", BASIS, frame, frame, BASIS)
    return turn


@cache
def _correction() -> CubicSpline:
    """Exact less far-field resistance (22, 22) of a pair along z, by the logarithm of its gap."""
    motions, loads = np.zeros((11, 11)), np.zeros((11, 11))
    for mode, (_, _, motion, load) in enumerate(_MODES):
        if isinstance(motion, np.ndarray):
            motions[3:, mode] = np.einsum("qkl,kl->q", BASIS, motion)
        else:
            motions[motion, mode] = 1.0
        loads[:, mode] = load * motions[:, mode]
    modes = np.linalg.inv(motions)
    gaps = np.geomspace(SMALLEST_GAP, REACH, GAPS)
    lacking = []
    for gap in gaps:
        far = _mobility(np.array([[0.0, 0.0, 2.0 * RADIUS + gap], [0.0, 0.0, 0.0]]))
        exact = np.zeros((2, 11, 2, 11))
        found = pair_resistance(gap)
        for p, (group, row, *_) in enumerate(_MODES):
            matrix = getattr(found, _MATRICES.get(group, group))
            matrix = matrix.reshape(2, len(matrix) // 2, 2, len(matrix) // 2)
            for q, (other, column, *_) in enumerate(_MODES):
                if other == group:
                    exact[:, p, :, q] = matrix[:, row, :, column]
        exact = np.einsum("ap,spuq,qb->saub", loads, exact, modes)
        lacking.append(exact.reshape(22, 22) - np.linalg.inv(far))
    return CubicSpline(np.log(gaps), lacking)
