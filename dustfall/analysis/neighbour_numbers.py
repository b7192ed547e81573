"""How the number of neighbours that a particle feels sets the velocity of a cloud."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.references import PAPER_SETTLING, PAPER_WINDOW
from dustfall.analysis.settling import case_of, from_time, steadiness, with_starts
from dustfall.analysis.time_averages import FEWEST_VALUES, Mean, mean_with_interval


def neighbour_numbers_table(
    runs: Iterable[xr.Dataset], starts: float | Sequence[float]
) -> pd.DataFrame:
    """Mean settling velocity of runs that differ in the number of neighbours, the paper's beside.

    Parameters
    ----------
    runs : series datasets with attribute neighbours
    starts : of the windows that are averaged, in tau, one for each run or one for all

    Returns
    -------
    columns neighbours, volume_fraction, n, status (`settling.steadiness`), value and half (of the
    95 % interval by batch means) [v_s], as_paper and as_paper_half (the same over the paper's
    window, NaN for a run that ends before it does or has too few steps in it), paper and relation
    (NaN and empty where it has none); sorted

    Raises
    ------
    ValueError : there is no run, or nothing is left after `start`.
    """
    paper = PAPER_SETTLING[PAPER_SETTLING["quantity"] == "inverse_beta"]
    points = {f"{row.volume_fraction:.6e}": row for row in paper.itertuples()}
    rows = []
    for run, start in with_starts(runs, starts):
        case, window = case_of(run), from_time(run, start, "step")
        mean = mean_with_interval(window["settling_velocity_mean"].values)
        early = _mean_as_paper(run)
        point = points.get(f"{case['volume_fraction']:.6e}")
        rows.append(
            {
                "neighbours": int(run.attrs["neighbours"]),
                "volume_fraction": case["volume_fraction"],
                "n": case["n"],
                "status": steadiness([window])[0],
                "value": mean.value,
                "half": mean.half_width,
                "as_paper": early.value if early else np.nan,
                "as_paper_half": early.half_width if early else np.nan,
                "paper": point.value if point else None,
                "relation": point.relation if point else "",
            }
        )
    table = pd.DataFrame(rows).sort_values(["volume_fraction", "neighbours"], ignore_index=True)
    return table.astype({"paper": float})


def _mean_as_paper(run: xr.Dataset) -> Mean | None:
    """Mean settling velocity over `PAPER_WINDOW`; none of a run that ends or hardly steps in it."""
    first, last = PAPER_WINDOW
    time = run["time"].values
    inside = (time >= first) & (time <= last)
    if time[-1] < last or inside.sum() < FEWEST_VALUES:
        return None
    return mean_with_interval(run["settling_velocity_mean"].values[inside])
