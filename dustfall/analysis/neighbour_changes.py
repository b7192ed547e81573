"""How often the five nearest neighbours change."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.settling import CASE, case_of, from_time
from dustfall.analysis.time_averages import mean_with_interval


def neighbour_changes(runs: Iterable[xr.Dataset], start: float) -> pd.DataFrame:
    """Tabulate the share of particles that get a new neighbour in a step, from `start` [tau] on.

    Parameters: `runs`, series datasets with new_neighbours (step), the share of particles whose set
    of five is another than a step ago, and only_farthest (step), the share of these in which only
    the farthest changed; attribute step [tau].

    Returns the columns model, n, volume_fraction, galileo, step, share, low, high (95 % interval,
    batch means), per_tau = share / step, and only_farthest, the share of all changes; sorted. Runs
    of one case are averaged, with the mean of their intervals' half-widths over the root of their
    number.
    """
    rows = []
    for run in runs:
        part = from_time(run, start, "step")
        mean = mean_with_interval(part["new_neighbours"].values)
        changes = part["new_neighbours"].values
        fifth = np.nan_to_num(part["only_farthest"].values)
        only = np.sum(changes * fifth) / np.sum(changes) if changes.any() else np.nan
        rows.append(
            case_of(run)
            | {
                "step": float(run.attrs["step"]),
                "share": mean.value,
                "half_width": mean.half_width,
                "only_farthest": only,
            }
        )
    if not rows:
        raise ValueError("there are no runs: at least one series is needed")
    cases = pd.DataFrame(rows).groupby([*CASE, "step"])
    table = cases.agg(
        share=("share", "mean"),
        half_width=("half_width", lambda h: h.mean() / np.sqrt(len(h))),
        only_farthest=("only_farthest", "mean"),
    ).reset_index()
    table["low"] = table["share"] - table["half_width"]
    table["high"] = table["share"] + table["half_width"]
    table["per_tau"] = table["share"] / table["step"]
    return table[[*CASE, "step", "share", "low", "high", "per_tau", "only_farthest"]]
