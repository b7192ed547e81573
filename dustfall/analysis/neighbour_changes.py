"""How often the nearest neighbours change."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.settling import CASE, case_of, from_time, steadiness, with_starts
from dustfall.analysis.time_averages import mean_of_runs, mean_with_interval


def neighbour_changes(runs: Iterable[xr.Dataset], starts: float | Sequence[float]) -> pd.DataFrame:
    """Tabulate the share of particles that get a new neighbour in a step.

    Parameters: `runs`, series datasets with new_neighbours (step), the share of particles whose set
    of neighbours is another than a step ago, only_farthest (step), the share of these in which only
    the farthest changed, and mean and variance of the settling velocity; attributes step [tau] and
    those of `settling.steady_state`; `starts` of the windows [tau], as there.

    Returns the columns model, n, volume_fraction, galileo, step, status (`settling.steadiness`: in
    a case that is not steady the share still changes), share, low, high (95 % interval of
    `time_averages.mean_of_runs`), per_tau = share / step, and only_farthest, the share of all
    changes; sorted.

    Raises ValueError where there is no run or nothing is left after `start`.
    """
    cases: dict[tuple, list[xr.Dataset]] = {}
    for run, start in with_starts(runs, starts):
        key = (*case_of(run).values(), float(run.attrs["step"]))
        cases.setdefault(key, []).append(from_time(run, start, "step"))
    rows = []
    for (*case, step), windows in sorted(cases.items()):
        mean = mean_of_runs([mean_with_interval(w["new_neighbours"].values) for w in windows])
        changes = np.concatenate([w["new_neighbours"].values for w in windows])
        # A step without changes has no share of its own.
        farthest = np.nan_to_num(np.concatenate([w["only_farthest"].values for w in windows]))
        rows.append(
            dict(zip(CASE, case, strict=True))
            | {
                "step": step,
                "status": steadiness(windows)[0],
                "share": mean.value,
                "low": mean.value - mean.half_width,
                "high": mean.value + mean.half_width,
                "per_tau": mean.value / step,
                "only_farthest": np.average(farthest, weights=changes) if changes.any() else np.nan,
            }
        )
    return pd.DataFrame(rows)
