"""Checks of what every solver is given: where spheres are, the flow that they meet, a tolerance."""

import math
import numbers

import numpy as np
import scipy

from dustfall.units import CONTACT, RADIUS

LARGEST = 1e100
"""Largest magnitude of a coordinate [d_p] or a flow, 1 / LARGEST the smallest of a flow that is
not zero: their squares are numbers still."""

TOUCH = 1e-5
"""How much nearer than a diameter two centres may be read to be: positions are stored in single
precision, or in text of few digits."""

MOST_RATIO = 1e3
"""Largest ratio of two radii: powers of it up to the 80th are numbers still."""


def checked_numbers(name: str, values) -> np.ndarray:
    """An own array of floats, its rows one after the other in memory, as kernels are compiled for.

    Raises ValueError for words, holes and rows of different lengths.
    """
    if np.ma.is_masked(values):
        hole = np.argwhere(np.ma.getmaskarray(values))[0].tolist()
        raise ValueError(f"{name} must be an array of numbers: the value at {hole} is missing")
    try:
        return np.array(values, dtype=float, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} must be an array of numbers: {error}") from None


def plain(value):
    """Python's own number in place of a NumPy scalar, which no JSON takes; all else as it is."""
    return value.item() if isinstance(value, np.generic) else value


def checked_positions(centres) -> np.ndarray:
    """Centres as an array (n, 3) [d_p] of spheres that may overlap.

    Raises ValueError for what is no (n, 3) numbers with n >= 1, and for coordinates that are not
    finite or beyond LARGEST.
    """
    centres = checked_numbers("centres", centres)
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise ValueError(f"centres must have the shape (n, 3) with n >= 1, not {centres.shape}")
    # One test lets nearly all scenes pass: what is not finite is not below LARGEST either.
    if (np.abs(centres) <= LARGEST).all():
        return centres
    bad = np.flatnonzero(~np.isfinite(centres).all(axis=1))
    if len(bad):
        raise ValueError(f"centre of sphere {bad[0]} is not finite: {centres[bad[0]].tolist()}")
    far = np.flatnonzero((np.abs(centres) > LARGEST).any(axis=1))[0]
    raise ValueError(
        f"centre of sphere {far} is {centres[far].tolist()} d_p: at most {LARGEST:g} d_p are "
        "allowed"
    )


def checked_centres(centres, radii=None) -> np.ndarray:
    """Centres as an array (n, 3) [d_p] of spheres that do not touch.

    radii: (n,) [d_p], as `checked_radii` returns them; half a diameter by default.
    Raises ValueError for what `checked_positions` refuses, and for spheres that overlap or touch.
    """
    return checked_scene(centres, radii)[0]


def checked_scene(centres, radii=None) -> tuple[np.ndarray, np.ndarray]:
    """Centres as `checked_centres` returns them, and their `centre_distances`."""
    centres = checked_positions(centres)
    return centres, checked_distances(centres, radii)


def checked_distances(centres, radii=None) -> np.ndarray:
    """The `centre_distances` of what `checked_positions` returned; ValueError for an overlap."""
    distance = centre_distances(centres)
    gaps = distance - (CONTACT if radii is None else radii[:, None] + radii)
    if gaps.min() <= 0.0:
        i, j = np.unravel_index(gaps.argmin(), gaps.shape)
        contact = CONTACT if radii is None else radii[i] + radii[j]
        raise ValueError(
            f"spheres {i} and {j} overlap or touch: their centres are {distance[i, j]:.6g} d_p "
            f"apart, more than {contact:g} is needed"
        )
    return distance


def checked_radii(radii, n: int) -> np.ndarray:
    """Radii as an array (n,) [d_p]; half a diameter each where none are given.

    Raises ValueError for another shape, for what is not positive and finite, and where the largest
    is more than MOST_RATIO times the smallest.
    """
    if radii is None:
        return np.full(n, RADIUS)
    radii = checked_numbers("radii", radii)
    if radii.shape != (n,):
        raise ValueError(
            f"radii must have the shape ({n},), one for each centre, not {radii.shape}"
        )
    bad = np.flatnonzero(~(np.isfinite(radii) & (radii > 0.0)))
    if len(bad):
        raise ValueError(f"radius of sphere {bad[0]} is {radii[bad[0]]}: it must be positive")
    if radii.max() > MOST_RATIO * radii.min():
        raise ValueError(
            f"radii from {radii.min():g} to {radii.max():g} d_p: the largest may be at most "
            f"{MOST_RATIO:g} times the smallest"
        )
    return radii


def checked_vectors(name: str, vectors, n: int) -> np.ndarray:
    """Vectors as an array (n, 3), zero where none are given; ValueError for other shapes, holes."""
    if vectors is None:
        return np.zeros((n, 3))
    vectors = checked_numbers(name, vectors)
    if vectors.shape != (n, 3):
        raise ValueError(
            f"{name} must have the shape ({n}, 3), one for each centre, not {vectors.shape}"
        )
    bad = np.flatnonzero(~(np.abs(vectors) <= LARGEST).all(axis=1))
    if len(bad):
        raise ValueError(
            f"{name} of sphere {bad[0]} is {vectors[bad[0]].tolist()}: allowed are numbers up to "
            f"{LARGEST:g}"
        )
    return vectors


def checked_gradient(gradient) -> np.ndarray:
    """Velocity gradient far away as an array (3, 3): row i is the gradient of component i.

    Raises ValueError for another shape, numbers that are not finite, and a fluid that expands.
    """
    if gradient is None:
        return np.zeros((3, 3))
    gradient = checked_numbers("gradient", gradient)
    if gradient.shape != (3, 3) or not (np.abs(gradient) <= LARGEST).all():
        raise ValueError(f"gradient must be (3, 3) finite numbers, not {gradient.tolist()}")
    trace = np.trace(gradient)
    if abs(trace) > 1e-12 * np.abs(gradient).max():
        raise ValueError(
            f"gradient has the trace {trace:g}: fluid keeps its volume, so it must be 0"
        )
    return gradient


def checked_flow(flow) -> np.ndarray:
    """Velocity far away as an array (3,).

    Raises ValueError for what is no three finite numbers, and for a magnitude that is neither zero
    nor between 1 / LARGEST and LARGEST.
    """
    flow = checked_numbers("flow", flow)
    # Of three numbers plain Python is quicker than NumPy, and every scene asks.
    if flow.shape != (3,) or not all(map(math.isfinite, flow)):
        raise ValueError(f"flow must be three finite numbers, not {flow.tolist()}")
    size = max(map(abs, flow))
    if size != 0.0 and not 1.0 / LARGEST <= size <= LARGEST:
        raise ValueError(
            f"flow {flow.tolist()}: its magnitude must be zero, or {1.0 / LARGEST:g} to {LARGEST:g}"
        )
    return flow


def flow_direction(flow) -> np.ndarray:
    """Unit vector (3,) along the flow, zero where nothing flows; refuses what `checked_flow` does.

    Forces are made dimensionless by the magnitude of the flow, so its direction is all they need.
    """
    flow = checked_flow(flow)
    speed = math.hypot(*flow)
    return flow / speed if speed > 0.0 else flow


def checked_tolerance(tolerance, lowest: float, highest: float) -> float:
    """The tolerance as a float; ValueError unless it is a number from `lowest` to `highest`."""
    if not isinstance(tolerance, numbers.Real) or not lowest <= float(tolerance) <= highest:
        raise ValueError(f"tolerance {tolerance!r}: allowed are {lowest:g} to {highest:g}")
    return float(tolerance)


def centre_distances(centres) -> np.ndarray:
    """(n, n) centre distances [d_p], inf on the diagonal."""
    distance = scipy.spatial.distance.cdist(centres, centres)
    distance.flat[:: len(distance) + 1] = np.inf
    return distance
