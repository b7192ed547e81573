"""What changes where neighbours move at their own velocities: means, fluctuations, close pairs."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
import scipy
import xarray as xr

from dustfall.analysis.settling import case_of, from_time, steadiness
from dustfall.analysis.time_averages import mean_with_interval

CLOSE = 1.1
"""Centre distance [d_p] up to which a pair counts as close."""


def moving_neighbours_table(
    runs: Iterable[tuple[xr.Dataset, xr.Dataset]], start: float
) -> pd.DataFrame:
    """Compare runs from one start with different closures, averaged from `start` [tau] on.

    Parameters
    ----------
    runs : series and trajectory of each; series with overlaps (step), trajectory with coordinates
        (frame, atom, spatial) and cell_lengths (frame, cell_spatial), both with time

    Returns
    -------
    columns closure, n, volume_fraction, status (`settling.steadiness`), velocity, velocity_half (of
        the 95 % interval by batch means), variance, variance_half [v_s, v_s^2], close_pairs and
        overlaps (mean numbers of pairs closer than `CLOSE` and than a diameter)

    Raises
    ------
    ValueError : nothing is left after `start`.
    """
    rows = []
    for series, trajectory in runs:
        window, frames = from_time(series, start, "step"), from_time(trajectory, start, "frame")
        case = case_of(series)
        velocity, variance = (
            mean_with_interval(window[f"settling_velocity_{name}"].values)
            for name in ("mean", "variance")
        )
        rows.append(
            {
                "closure": series.attrs["closure"],
                "n": case["n"],
                "volume_fraction": case["volume_fraction"],
                "status": steadiness([window])[0],
                "velocity": velocity.value,
                "velocity_half": velocity.half_width,
                "variance": variance.value,
                "variance_half": variance.half_width,
                "close_pairs": np.mean([_close_pairs(frame) for frame in _each(frames)]),
                "overlaps": float(window["overlaps"].mean()),
            }
        )
    return pd.DataFrame(rows)


def _each(frames):
    return (frames.isel(frame=k) for k in range(frames.sizes["frame"]))


def _close_pairs(frame) -> int:
    """Number of pairs with centres closer than `CLOSE` in the periodic cube."""
    side = np.asarray(frame["cell_lengths"], dtype=float)
    position = np.mod(np.asarray(frame["coordinates"], dtype=float), side)
    # The remainder of a tiny negative number is the side itself.
    tree = scipy.spatial.cKDTree(np.where(position < side, position, 0.0), boxsize=side)
    return len(tree.query_pairs(CLOSE))
