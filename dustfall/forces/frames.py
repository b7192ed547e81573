"""Frames of a scene: streamwise rotation, spherical coordinates, and the canonical frame.

The flow frame has x spanwise, y streamwise (the flow runs along +y) and z vertical.
"""

import numpy as np
from numba import njit

from dustfall.spheres import LARGEST, checked_numbers
from dustfall.units import CONTACT

MOST_NEIGHBOURS = 50
"""Most neighbours of a scene: the dense system of a sphere and its neighbours is then 153 x 153."""

_ZERO = 1e-9  # relative size below which a coordinate has no sign that rounding would keep


def rotation_to_streamwise(velocity) -> np.ndarray:
    """Return the rotations that turn each relative velocity into the streamwise direction +y.

    Parameters: `velocity` (n, 3) or (3,), any unit. Returns (n, 3, 3) or (3, 3) with
    `R u/|u| = (0, 1, 0)`, `R R^T = 1` and `det R = +1`. It is the smallest rotation that does so
    (Rodrigues; paper, appendix "Coordinate system transformations", there printed transposed).
    Exactly against the flow, where the smallest rotation is not unique, it is the half turn
    about z. A zero velocity has no direction and no drag: its rotation is the identity.

    Raises ValueError for another shape or a value that is not finite.
    """
    velocity = np.asarray(velocity, dtype=float)
    if velocity.ndim not in (1, 2) or velocity.shape[-1] != 3:
        raise ValueError(f"velocity has shape {velocity.shape}; it must be (n, 3) or (3,)")
    if not np.isfinite(velocity).all():
        raise ValueError("velocity holds a value that is not finite")
    rotation = _rotations(np.ascontiguousarray(np.atleast_2d(velocity)))
    return rotation[0] if velocity.ndim == 1 else rotation


@njit(cache=True, nogil=True)
def _rotations(velocity):
    rotation = np.empty((velocity.shape[0], 3, 3))
    for n in range(velocity.shape[0]):
        # Scaling first keeps the squares of very small and very large velocities in range.
        scale = max(abs(velocity[n, 0]), abs(velocity[n, 1]), abs(velocity[n, 2]))
        if scale == 0.0:
            x, c, z = 0.0, 1.0, 0.0
        else:
            x, c, z = velocity[n, 0] / scale, velocity[n, 1] / scale, velocity[n, 2] / scale
            length = np.sqrt(x * x + c * c + z * z)
            x, c, z = x / length, c / length, z / length
        if c > -0.5:
            q = 1.0 / (1.0 + c)
            xx, zz, xz = q * x * x, q * z * z, q * x * z
        else:
            # 1 + c cancels near the antiparallel direction; there (1 - c) (x, z)/|(x, z)| is exact.
            s = max(abs(x), abs(z))
            a, b = (x / s, z / s) if s > 0.0 else (1.0, 0.0)
            q = (1.0 - c) / (a * a + b * b)
            xx, zz, xz = q * a * a, q * b * b, q * a * b
        rotation[n, 0, 0] = c + zz
        rotation[n, 0, 1] = -x
        rotation[n, 0, 2] = -xz
        rotation[n, 1, 0] = x
        rotation[n, 1, 1] = c
        rotation[n, 1, 2] = z
        rotation[n, 2, 0] = -xz
        rotation[n, 2, 1] = -z
        rotation[n, 2, 2] = c + xx
    return rotation


def spherical_coordinates(positions) -> np.ndarray:
    """Return radius, azimuth and polar angle of Cartesian positions.

    Parameters: `positions` (..., 3). Returns (..., 3): r in the unit of the positions, azimuth
    in (-pi, pi] in the spanwise-streamwise plane from +x, polar angle in [0, pi] from +z (the axes
    that the paper's correlation figure fits).
    """
    x, y, z = np.moveaxis(np.asarray(positions, dtype=float), -1, 0)
    square = x * x + y * y
    coordinates = np.empty((*x.shape, 3))
    np.sqrt(square + z * z, out=coordinates[..., 0])
    np.arctan2(y, x, out=coordinates[..., 1])
    np.arctan2(np.sqrt(square), z, out=coordinates[..., 2])
    return coordinates


def check_neighbours(neighbours, number: int | None = None) -> np.ndarray:
    """Return the neighbours as contiguous float64 (m, k, 3), or raise ValueError.

    A wrong shape, another `number` k than the given one, a value that is not finite or beyond
    LARGEST and a neighbour at the centre of the reference sphere (it has no direction) are refused.
    """
    neighbours = np.ascontiguousarray(checked_numbers("neighbours", neighbours))
    allowed = range(1, MOST_NEIGHBOURS + 1) if number is None else (number,)
    if neighbours.ndim != 3 or neighbours.shape[2] != 3 or neighbours.shape[1] not in allowed:
        expected = f"k from 1 to {MOST_NEIGHBOURS}" if number is None else f"k = {number}"
        raise ValueError(
            f"neighbours have shape {neighbours.shape}; the model takes (m, k, 3), the Cartesian "
            f"positions of k neighbours in d_p, {expected}"
        )
    if not np.isfinite(neighbours).all():
        scene = int(np.flatnonzero(~np.isfinite(neighbours).all(axis=(1, 2)))[0])
        raise ValueError(f"neighbours of scene {scene} hold a value that is not finite")
    far = np.abs(neighbours) > LARGEST
    if far.any():
        scene = int(np.argwhere(far)[0, 0])
        raise ValueError(f"neighbours of scene {scene} are beyond {LARGEST:g} d_p")
    # Squares, because their underflow to zero is what would divide by zero later.
    central = np.einsum("mjk,mjk->mj", neighbours, neighbours) == 0.0
    if central.any():
        scene, neighbour = (int(i) for i in np.argwhere(central)[0])
        raise ValueError(
            f"neighbour {neighbour} of scene {scene} is at the centre of the reference sphere; "
            "its distance must be above zero"
        )
    return neighbours


@njit(cache=True, nogil=True)
def sort_by_distance(neighbours):
    """Return scenes (m, k, 3) with neighbours in order of distance from the reference sphere.

    Equal distances are put in order by y, x, z, so that the given order never matters.
    """
    result = np.empty_like(neighbours)
    count = neighbours.shape[1]
    square = np.empty(count)
    order = np.empty(count, np.int64)
    for m in range(neighbours.shape[0]):
        for j in range(count):
            own = neighbours[m, j, 0] ** 2 + neighbours[m, j, 1] ** 2 + neighbours[m, j, 2] ** 2
            i = j
            while i > 0 and (
                own < square[i - 1]
                or (own == square[i - 1] and _is_before(neighbours, m, j, order[i - 1]))
            ):
                square[i], order[i] = square[i - 1], order[i - 1]
                i -= 1
            square[i], order[i] = own, j
        for i in range(count):
            for k in range(3):
                result[m, i, k] = neighbours[m, order[i], k]
    return result


@njit(cache=True, nogil=True)
def _is_before(neighbours, m, j, i):
    for k in (1, 0, 2):
        if neighbours[m, j, k] != neighbours[m, i, k]:
            return neighbours[m, j, k] < neighbours[m, i, k]
    return False


@njit(cache=True, nogil=True)
def hold_at_contact(neighbours):
    """Return scenes (m, k, 3) where each neighbour closer than one d_p is moved out to one d_p."""
    result = np.empty_like(neighbours)
    for m in range(neighbours.shape[0]):
        for j in range(neighbours.shape[1]):
            distance = _length(neighbours[m, j])
            scale = CONTACT / distance if distance < CONTACT else 1.0
            for k in range(3):
                result[m, j, k] = scale * neighbours[m, j, k]
    return result


@njit(cache=True, nogil=True)
def canonical_frame(neighbours):
    """Bring sorted scenes into the canonical frame of the symmetries of Stokes flow.

    Point inversion of all neighbours leaves the force unchanged, rotation about the flow axis and
    mirrors through it carry the lateral force along (exact in Stokes flow). So the scene is
    inverted until neighbour 1 has y >= 0, turned until its azimuth about the flow axis is zero
    (z = 0, x >= 0) and mirrored until neighbour 2 has z >= 0. Where a neighbour cannot decide
    (its coordinate is zero to rounding), the next one does.

    Takes `neighbours` (m, k, 3), sorted; returns the canonical neighbours (m, k, 3) and the
    lateral axes (m, 2, 2): the force in the flow frame has the lateral part
    `(F_x, F_z) = F'_x axes[0] + F'_z axes[1]`, see `lateral_to_flow_frame`.
    """
    canonical = np.empty_like(neighbours)
    count = neighbours.shape[1]
    axes = np.empty((neighbours.shape[0], 2, 2))
    for m in range(neighbours.shape[0]):
        scene = neighbours[m]
        inversion = 1.0
        for j in range(count):
            if abs(scene[j, 1]) > _ZERO * _length(scene[j]):
                inversion = 1.0 if scene[j, 1] > 0.0 else -1.0
                break
        cosine, sine = 1.0, 0.0
        for j in range(count):
            rho = np.sqrt(scene[j, 0] ** 2 + scene[j, 2] ** 2)
            if rho > _ZERO * _length(scene[j]):
                cosine = inversion * scene[j, 0] / rho
                sine = inversion * scene[j, 2] / rho
                break
        mirror = 1.0
        for j in range(count):
            z = inversion * (cosine * scene[j, 2] - sine * scene[j, 0])
            if abs(z) > _ZERO * _length(scene[j]):
                mirror = 1.0 if z > 0.0 else -1.0
                break
        axes[m, 0, 0], axes[m, 0, 1] = cosine, sine
        axes[m, 1, 0], axes[m, 1, 1] = -mirror * sine, mirror * cosine
        for j in range(count):
            x, z = inversion * scene[j, 0], inversion * scene[j, 2]
            canonical[m, j, 0] = cosine * x + sine * z
            canonical[m, j, 1] = inversion * scene[j, 1]
            canonical[m, j, 2] = mirror * (cosine * z - sine * x)
    return canonical, axes


@njit(cache=True, nogil=True)
def _length(vector):
    return np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


def lateral_to_flow_frame(lateral: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Turn lateral forces (m, 2) of the canonical frame into (F_x, F_z) of the flow frame."""
    return np.einsum("mk,mki->mi", lateral, axes)


def lateral_to_canonical_frame(lateral: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Turn lateral forces (F_x, F_z) (m, 2) of the flow frame into the canonical frame."""
    return np.einsum("mi,mki->mk", lateral, axes)
