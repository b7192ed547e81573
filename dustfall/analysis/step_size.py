"""How the time step shows in what a run measures."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.settling import from_time
from dustfall.analysis.time_averages import mean_with_interval

STEADY = ("inverse_beta_mean", "settling_velocity_mean", "settling_velocity_variance")


def step_size_table(runs: Iterable[xr.Dataset], start: float, together: float) -> pd.DataFrame:
    """Compare runs that differ in their time step alone, the smallest step first.

    In the steady state the motion is chaotic and only averages can be compared, within their
    intervals. Early on, the paths of two runs from the same start are still together, and the
    difference is the error of the step.

    Parameters
    ----------
    runs : series datasets with attribute step [tau]
    start : of the steady state, in tau
    together : until when a run is compared with that of the smallest step, in tau

    Returns
    -------
    columns step [tau]; for the mean over particles of 1/beta and of the settling velocity, and
    for the variance of the latter, the steady value and the half-width of its 95 % interval;
    early_error, the largest difference up to `together` of mean 1/beta from the smallest
    step's; new_neighbours and only_farthest (of these) a step; overlaps, the mean number of pairs

    Raises
    ------
    ValueError : there is no run, two have the same step, or nothing is left after `start`.
    """
    runs = sorted(runs, key=lambda run: float(run.attrs["step"]))
    steps = [float(run.attrs["step"]) for run in runs]
    if not runs or len(set(steps)) < len(steps):
        raise ValueError(f"steps are {steps}: at least one is needed, and none twice")
    rows = []
    for step, run in zip(steps, runs, strict=True):
        steady = from_time(run, start, "step")
        row = {"step": step}
        for name in STEADY:
            mean = mean_with_interval(steady[name].values)
            row |= {name: mean.value, f"{name}_half_width": mean.half_width}
        early = run.isel(step=np.flatnonzero(run["time"].values <= together * (1 + 1e-9)))
        finest = np.interp(early["time"], runs[0]["time"], runs[0]["inverse_beta_mean"])
        row["early_error"] = float(np.abs(early["inverse_beta_mean"] - finest).max())
        changes = steady["new_neighbours"].values
        farthest = np.nan_to_num(steady["only_farthest"].values)
        row["new_neighbours"] = changes.mean()
        row["only_farthest"] = np.average(farthest, weights=changes) if changes.any() else np.nan
        row["overlaps"] = float(steady["overlaps"].mean())
        rows.append(row)
    return pd.DataFrame(rows)
