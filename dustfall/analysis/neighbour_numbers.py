"""How the number of neighbours that a particle feels sets the velocity of a cloud."""

from collections.abc import Iterable

import pandas as pd
import xarray as xr

from dustfall.analysis.references import PAPER_SETTLING
from dustfall.analysis.settling import case_of, from_time
from dustfall.analysis.time_averages import mean_with_interval


def neighbour_numbers_table(runs: Iterable[xr.Dataset], start: float) -> pd.DataFrame:
    """Mean settling velocity of runs that differ in the number of neighbours, the paper's beside.

    Parameters
    ----------
    runs : series datasets with attribute neighbours
    start : of the window that is averaged, in tau; whether the state is steady is not asked, as the
        paper averages without asking

    Returns
    -------
    columns neighbours, volume_fraction, n, value and half (of the 95 % interval by batch means)
    [v_s], paper and relation (NaN and empty where it has no point); sorted

    Raises
    ------
    ValueError : there is no run, or nothing is left after `start`.
    """
    paper = PAPER_SETTLING[PAPER_SETTLING["quantity"] == "inverse_beta"]
    points = {f"{row.volume_fraction:.6e}": row for row in paper.itertuples()}
    rows = []
    for run in runs:
        case = case_of(run)
        mean = mean_with_interval(from_time(run, start, "step")["settling_velocity_mean"].values)
        point = points.get(f"{case['volume_fraction']:.6e}")
        rows.append(
            {
                "neighbours": int(run.attrs["neighbours"]),
                "volume_fraction": case["volume_fraction"],
                "n": case["n"],
                "value": mean.value,
                "half": mean.half_width,
                "paper": point.value if point else None,
                "relation": point.relation if point else "",
            }
        )
    if not rows:
        raise ValueError("there are no runs: at least one series is needed")
    table = pd.DataFrame(rows).sort_values(["volume_fraction", "neighbours"], ignore_index=True)
    return table.astype({"paper": float})
