"""Time average against ensemble average of the settling velocity."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.settling import case_of, settling_velocities, with_starts


def spread_of_time_averages(velocity) -> pd.DataFrame:
    """How far time averages of single particles still differ, against the length of the average.

    Parameters: `velocity` (frames, n). Windows of 1, 2, 4, … frames and of all are cut from the
    run; the variance over particles of the mean velocity within a window, averaged over windows,
    is divided by that of their single frames, the ensemble's. In an ergodic system every particle
    has the ensemble's mean in the end and the ratio falls as 1/window; where each particle keeps
    the velocity that its start gave it, the ratio stays one (ergodic measure of Thirumalai,
    Mountain & Kirkpatrick 1989, Phys. Rev. A 39, 3563).

    Returns the columns frames, spread. Raises ValueError where all particles have one velocity.
    """
    velocity = np.asarray(velocity, dtype=float)
    ensemble = velocity.var(axis=1)
    if not ensemble.any():
        raise ValueError("all particles have the same velocity: there is nothing to compare")
    total = len(velocity)
    lengths = sorted({2**k for k in range(total.bit_length()) if 2**k < total} | {total})
    spread = []
    for length in lengths:
        used = total // length * length
        windows = velocity[:used].reshape(-1, length, velocity.shape[1])
        spread.append(windows.mean(axis=1).var(axis=1).mean() / ensemble[:used].mean())
    return pd.DataFrame({"frames": lengths, "spread": spread})


def ergodicity_table(
    trajectories: Iterable[xr.Dataset], starts: float | Sequence[float]
) -> pd.DataFrame:
    """Tabulate the spread of time averages for each trajectory, from its start [tau] on.

    Returns the columns model, n, volume_fraction, galileo, window [tau], spread, and ensemble_mean
    and ensemble_variance of the settling velocity [v_s, v_s^2]. A cloud whose particles all have
    one velocity (isolated Stokes) has no rows.

    Raises ValueError where no trajectory is left, or as `settling_velocities` does.
    """
    tables = []
    for trajectory, start in with_starts(trajectories, starts):
        velocity, interval = settling_velocities(trajectory, start)
        if velocity.var(axis=1).any():
            table = spread_of_time_averages(velocity)
            window = interval * table.pop("frames")
            moments = {
                "ensemble_mean": velocity.mean(),
                "ensemble_variance": velocity.var(axis=1).mean(),
            }
            tables.append(table.assign(window=window, **case_of(trajectory), **moments))
    if not tables:
        raise ValueError("there is no trajectory whose particles differ in velocity")
    columns = ["model", "n", "volume_fraction", "galileo", "window", "spread"]
    table = pd.concat(tables, ignore_index=True)[[*columns, "ensemble_mean", "ensemble_variance"]]
    return table.sort_values(columns[:5], ignore_index=True)
