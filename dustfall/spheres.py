"""Checks of what every solver is given: where spheres are, and the flow that they meet."""

import numpy as np


def checked_centres(centres) -> np.ndarray:
    """Centres as an array (n, 3) [d_p]; ValueError for a wrong shape, NaN, or overlap."""
    centres = np.ascontiguousarray(centres, dtype=float)
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise ValueError(f"centres must have the shape (n, 3) with n >= 1, not {centres.shape}")
    bad = np.flatnonzero(~np.isfinite(centres).all(axis=1))
    if len(bad):
        raise ValueError(f"centre of sphere {bad[0]} is not finite: {centres[bad[0]].tolist()}")
    distance = centre_distances(centres)
    i, j = np.unravel_index(distance.argmin(), distance.shape)
    if distance[i, j] <= 1.0:
        raise ValueError(
            f"spheres {i} and {j} overlap or touch: their centres are {distance[i, j]:.6g} d_p "
            "apart, more than 1 is needed"
        )
    return centres


def checked_flow(flow) -> np.ndarray:
    """Velocity far away as an array (3,); ValueError for a wrong shape or NaN."""
    flow = np.asarray(flow, dtype=float)
    if flow.shape != (3,) or not np.isfinite(flow).all():
        raise ValueError(f"flow must be three finite numbers, not {flow.tolist()}")
    return flow


def centre_distances(centres) -> np.ndarray:
    """(n, n) centre distances [d_p], inf on the diagonal."""
    difference = centres[:, None, :] - centres[None, :, :]
    distance = np.sqrt((difference**2).sum(axis=2))
    np.fill_diagonal(distance, np.inf)
    return distance
