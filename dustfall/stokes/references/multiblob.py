"""Rigid multiblobs: spheres made of blobs that interact by the Rotne-Prager mobility.

The peer method of the benchmark (Usabiaga et al. 2016), which shares no code with the solver.
"""

from functools import cache

import numpy as np
from numba import njit
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq
from scipy.spatial import ConvexHull

from dustfall.spheres import checked_centres, checked_vectors, flow_direction
from dustfall.units import RADIUS, STOKES_DRAG


@cache
def shell(subdivisions: int) -> np.ndarray:
    """Unit vectors (12, 42 or 162, 3) for 0, 1 or 2 subdivisions of the icosahedron's edges."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = [(0.0, a, b * golden) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    points = np.array([np.roll(corner, k) for corner in corners for k in range(3)])
    points /= np.linalg.norm(points[0])
    for _ in range(subdivisions):
        triangles = ConvexHull(points).simplices
        sides = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
        middles = points[sides].sum(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        points = np.concatenate([points, middles])
    return points


@njit(cache=True)
def _mobility(points, radius):
    """Rotne-Prager mobility (3n, 3n) of equal blobs, overlapping ones too (Wajnryb et al. 2013)."""
    n = len(points)
    out = np.zeros((3 * n, 3 * n))
    for i in range(n):
        for j in range(i + 1):
            if i == j:
                isotropic, along = 1.0 / (6.0 * np.pi * radius), 0.0
                direction = np.zeros(3)
            else:
                direction = points[i] - points[j]
                r = np.sqrt(np.sum(direction**2))
                direction /= r
                if r > 2.0 * radius:
                    ratio = (radius / r) ** 2
                    isotropic = (1.0 + 2.0 * ratio / 3.0) / (8.0 * np.pi * r)
                    along = (1.0 - 2.0 * ratio) / (8.0 * np.pi * r)
                else:
                    isotropic = (1.0 - 9.0 * r / (32.0 * radius)) / (6.0 * np.pi * radius)
                    along = 3.0 * r / (32.0 * radius) / (6.0 * np.pi * radius)
            for a in range(3):
                for b in range(3):
                    value = along * direction[a] * direction[b]
                    if a == b:
                        value += isotropic
                    out[3 * i + a, 3 * j + b] = out[3 * j + b, 3 * i + a] = value
    return out


def _forces(spheres, points, radius, velocities):
    """Force on each sphere [radii, mu = 1] whose blobs, at `points` about its centre, are held in a
    flow of the given velocities there, (n, 3) for all or (n, m, 3)."""
    blobs = (spheres[:, None] + points).reshape(-1, 3)
    factor = cho_factor(_mobility(blobs, radius), overwrite_a=True, check_finite=False)
    velocities = np.broadcast_to(velocities, (len(spheres), len(points), 3))
    pulls = cho_solve(factor, velocities.ravel(), check_finite=False)
    return pulls.reshape(len(spheres), len(points), 3).sum(axis=1)


@cache
def _radii(subdivisions: int) -> tuple[float, float]:
    """Radius of the shell of blobs and of a blob, for a sphere of radius 1.

    Neighbouring blobs touch, and the isolated sphere has its Stokes drag: the choice of Usabiaga
    et al. (2016).
    """
    points = shell(subdivisions)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    touching = 0.5 * apart[apart > 0.0].min()
    flow = np.array([0.0, 1.0, 0.0])

    def excess(size):
        force = _forces(np.zeros((1, 3)), size * points, size * touching, flow)
        return force[0, 1] - 6.0 * np.pi

    size = brentq(excess, 0.5, 1.1, xtol=1e-12)
    return size, size * touching


def multiblob_forces(centres, subdivisions: int, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Force on each of n fixed spheres in a uniform flow, (n, 3) [Re_p c_D].

    centres: (n, 3) [d_p]. subdivisions: 0, 1, 2 for 12, 42, 162 blobs a sphere. flow: (3,), its
    magnitude makes forces dimensionless. Raises ValueError for centres or a flow that are refused
    everywhere, and numpy.linalg.LinAlgError where blobs of two spheres come so close that their
    mobility is not positive definite.
    """
    size, blob = _radii(subdivisions)
    spheres = checked_centres(centres) / RADIUS
    force = _forces(spheres, size * shell(subdivisions), blob, flow_direction(flow))
    return STOKES_DRAG / (6.0 * np.pi) * force


def moving_multiblob_forces(centres, velocity, angular_velocity, subdivisions: int) -> np.ndarray:
    """Force on each of n spheres that translate and turn in fluid at rest, (n, 3) [3 pi mu d_p U].

    centres [d_p], velocity [U], angular_velocity [U / d_p]: (n, 3). Others as `multiblob_forces`.
    """
    size, blob = _radii(subdivisions)
    points = size * shell(subdivisions)
    spheres = checked_centres(centres) / RADIUS
    turning = np.cross(
        checked_vectors("angular_velocity", angular_velocity, len(spheres))[:, None], points
    )
    moving = checked_vectors("velocity", velocity, len(spheres))[:, None] + RADIUS * turning
    return _forces(spheres, points, blob, -moving) / (6.0 * np.pi)
