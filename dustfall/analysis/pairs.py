"""Where the particles of a settling cloud are as others see them: pairs, and local density."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import scipy
import xarray as xr

from dustfall.analysis.settling import case_of, from_time, with_starts
from dustfall.scenes import volume_fraction
from dustfall.sedimentation.neighbours import nearest_neighbours
from dustfall.sedimentation.properties import mean_spacing
from dustfall.suspension.cube import folded
from dustfall.units import CONTACT, NEIGHBOURS

SHELLS = 24
"""Shells of a pair distribution, in geometric progression of their radii."""

FARTHEST = 3.0
"""Outermost radius, in mean spacings: some hundred neighbours; half the side of the cube bounds it
where that is smaller."""


def pair_distribution(positions, length: float, edges) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of points by their distance, over those of random points, and how upright they stand.

    Parameters: `positions` (n, 3), wrapped or not, in a periodic cube of side `length`; `edges`
    (k + 1,) of shells, within half of the side. Returns g (k,), one for random points at any
    distance, and 3 times the mean of cos^2 of the angle with the vertical (k,): one where no
    direction is preferred, three for pairs above each other, NaN in a shell without pairs.

    Raises ValueError for edges that do not rise from zero or more to at most half of the side.
    """
    edges = np.asarray(edges, dtype=float)
    if not (edges[0] >= 0 and (np.diff(edges) > 0).all() and edges[-1] <= length / 2):
        raise ValueError(
            f"the shells reach from {edges[0]:g} to {edges[-1]:g}: they have to rise from 0 or "
            f"more to at most half the side of the cube, {length / 2:g}"
        )
    positions = np.ascontiguousarray(positions, dtype=float)
    n = len(positions)
    here = folded(positions, length)
    pair = scipy.spatial.cKDTree(here, boxsize=length).query_pairs(edges[-1], output_type="ndarray")
    apart = here[pair[:, 0]] - here[pair[:, 1]]
    apart -= length * np.rint(apart / length)
    square = (apart**2).sum(axis=1)
    shell = np.searchsorted(edges, np.sqrt(square), side="right") - 1
    inside = (shell >= 0) & (shell < len(edges) - 1) & (square > 0)
    shell, upright = shell[inside], 3 * apart[inside, 2] ** 2 / square[inside]
    count = np.bincount(shell, minlength=len(edges) - 1)
    volume = 4 / 3 * np.pi * np.diff(edges**3)
    expected = n * (n - 1) / 2 * volume / length**3
    total = np.bincount(shell, upright, minlength=len(edges) - 1)
    vertical = np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
    return count / expected, vertical


def pair_distribution_table(
    trajectories: Iterable[xr.Dataset], starts: float | Sequence[float], snapshots=20
) -> pd.DataFrame:
    """Tabulate the pair distribution of each cloud over some frames of its window.

    Parameters: `trajectories`, `starts` of the windows [tau], one for each or one for all,
    `snapshots`, the most frames, evenly spaced. Returns the columns model, n, volume_fraction,
    galileo, distance [d_p] (geometric middle of a shell), density, low, high (95 % interval by the
    spread between frames, too narrow where a cloud changes little between them) and vertical.

    Raises ValueError as `settling.from_time` does.
    """
    tables = []
    for trajectory, start in with_starts(trajectories, starts):
        case, frames = case_of(trajectory), _frames(trajectory, start, snapshots)
        length = float(trajectory["cell_lengths"][0, 0])
        last = min(FARTHEST * mean_spacing(case["volume_fraction"]), length / 2)
        edges = np.geomspace(CONTACT, last, SHELLS + 1)
        found = np.array(
            [pair_distribution(frame.values, length, edges) for frame in frames["coordinates"]]
        )
        density = found[:, 0].mean(axis=0)
        half = 0.0
        if len(found) > 1:
            error = found[:, 0].std(axis=0, ddof=1) / np.sqrt(len(found))
            half = scipy.stats.t.ppf(0.975, len(found) - 1) * error
        columns = {"distance": np.sqrt(edges[1:] * edges[:-1]), "density": density}
        columns |= {"low": np.maximum(density - half, 0.0), "high": density + half}
        seen = np.isfinite(found[:, 1])
        vertical = np.where(seen, found[:, 1], 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
        columns["vertical"] = np.where(seen.any(axis=0), vertical, np.nan)
        tables.append(pd.DataFrame(case | columns))
    return pd.concat(tables, ignore_index=True)


def local_volume_fraction(positions, length: float) -> np.ndarray:
    """Volume fraction (n,) around each particle by its fifth neighbour, as the paper takes it.

    `scenes.volume_fraction` of the distance to the fifth neighbour (paper, section "Mineral dust
    sedimentation"). A biased estimate: over random points its mean is 5/4 of the bulk's, as the
    volume of the ball that reaches to the fifth has a gamma law of shape five, whose inverse has
    the mean 1/4 in spacings.
    """
    vectors, _ = nearest_neighbours(positions, length, NEIGHBOURS)
    farthest = np.linalg.norm(vectors[:, -1], axis=1)
    return volume_fraction(farthest)


def local_volume_fraction_table(
    trajectories: Iterable[xr.Dataset],
    starts: float | Sequence[float],
    densest: float,
    snapshots=20,
) -> pd.DataFrame:
    """Tabulate the local volume fraction at the start and over the window of each cloud.

    Parameters: as of `pair_distribution_table`, and `densest`, the largest volume fraction that
    force models were trained on. Returns the columns model, n, volume_fraction, galileo, time
    ("start" or "window"), mean (over that of the bulk; 5/4 for random points), median, deviation
    (both over that of the bulk), above (share of particles above `densest`).
    """
    rows = []
    for trajectory, start in with_starts(trajectories, starts):
        case = case_of(trajectory)
        length = float(trajectory["cell_lengths"][0, 0])
        parts = {
            "start": trajectory.isel(frame=[0]),
            "window": _frames(trajectory, start, snapshots),
        }
        for time, part in parts.items():
            found = np.concatenate(
                [
                    local_volume_fraction(np.asarray(frame, dtype=float), length)
                    for frame in part["coordinates"].values
                ]
            )
            over = found / case["volume_fraction"]
            rows.append(
                case
                | {
                    "time": time,
                    "mean": over.mean(),
                    "median": np.median(over),
                    "deviation": over.std(),
                    "above": (found > densest).mean(),
                }
            )
    return pd.DataFrame(rows)


def _frames(trajectory: xr.Dataset, start: float, snapshots: int) -> xr.Dataset:
    """At most so many frames from `start` [tau] on, evenly spaced."""
    part = from_time(trajectory, start, "frame")
    number = part.sizes["frame"]
    chosen = np.linspace(0, number - 1, min(snapshots, number)).round().astype(int)
    return part.isel(frame=np.unique(chosen))
