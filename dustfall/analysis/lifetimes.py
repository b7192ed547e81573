"""How long clusters live: for how long particles keep their crowd and their velocity."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.settling import (
    case_of,
    even_interval,
    from_time,
    stokes_number,
    with_starts,
)
from dustfall.analysis.voronoi import voronoi_volumes
from dustfall.sedimentation.properties import mean_spacing

CROWDED = 0.1
"""Share of the particles, those with the smallest Voronoi cells, that count as clustered."""

DECAYED = np.exp(-1.0)
"""What is left of a correlation after its lifetime."""


def autocorrelation(values) -> np.ndarray:
    """Correlation of values (frames, n) with themselves by lag (frames // 2,), over particles.

    Values are taken about the mean of each frame, and products averaged over particles and pairs
    of frames; one at lag zero. Raises ValueError where all particles have one value.
    """
    values = np.asarray(values, dtype=float)
    about = values - values.mean(axis=1, keepdims=True)
    variance = (about**2).mean()
    if not variance > 0:
        raise ValueError("all particles have the same value: there is nothing to correlate")
    frames = len(values)
    lags = range(max(1, frames // 2))
    return np.array([(about[: frames - k] * about[k:]).mean() for k in lags]) / variance


def lifetime(lag, correlation) -> float:
    """Lag at which a correlation first falls below 1/e, between two samples; NaN: it does not."""
    below = np.flatnonzero(np.asarray(correlation) < DECAYED)
    if not below.size:
        return float("nan")
    k = int(below[0])
    return float(np.interp(DECAYED, correlation[[k, k - 1]], [lag[k], lag[k - 1]]))


def lifetimes_table(
    trajectories: Iterable[xr.Dataset], starts: float | Sequence[float], progress=None
) -> pd.DataFrame:
    """Tabulate the autocorrelation of velocity and of membership in clusters for each cloud.

    Parameters: `trajectories`, `starts` of their windows [tau], one for each or one for all. A
    particle is in a cluster while its Voronoi cell is among the smallest tenth (`CROWDED`).

    Returns the columns model, n, volume_fraction, galileo, quantity ("settling velocity" or
    "membership"), lag [tau], spreading_times (the same in units of
    `sedimentation.Properties.spreading_time`), correlation, and lifetime and lifetime_spreading
    (`lifetime` in both units, the same in all rows of a curve).

    Raises ValueError as `settling.even_interval` and `autocorrelation` do.
    """
    tables = []
    pairs = with_starts(trajectories, starts)
    for done, (trajectory, start) in enumerate(pairs, start=1):
        case, part = case_of(trajectory), from_time(trajectory, start, "frame")
        interval = even_interval(part["time"])
        unit = mean_spacing(case["volume_fraction"]) ** 2 / stokes_number(trajectory)
        length = float(part["cell_lengths"][0, 0])
        volumes = np.array([voronoi_volumes(x, length) for x in part["coordinates"].values])
        crowded = volumes <= np.quantile(volumes, CROWDED, axis=1, keepdims=True)
        for quantity, values in {
            "settling velocity": -part["velocities"].values[:, :, 2],
            "membership": crowded,
        }.items():
            correlation = autocorrelation(values)
            lag = interval * np.arange(len(correlation))
            lived = lifetime(lag, correlation)
            columns = {
                "quantity": quantity,
                "lag": lag,
                "spreading_times": lag / unit,
                "correlation": correlation,
                "lifetime": lived,
                "lifetime_spreading": lived / unit,
            }
            tables.append(pd.DataFrame(case | columns))
        if progress:
            progress(done, len(pairs))
    return pd.concat(tables, ignore_index=True)
