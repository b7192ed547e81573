"""Clouds that settle by different closures from the same starts, side by side."""

from collections.abc import Sequence

import pandas as pd
import xarray as xr

from dustfall.analysis.pairs import pair_distribution_table
from dustfall.analysis.settling import case_of, settling_in_time
from dustfall.analysis.spectra import cloud_spectra
from dustfall.analysis.voronoi import pooled_volumes, volume_distribution

CASE = ["model", "n"]

SPECTRUM = "welch"
"""Of the two ways to a spectrum the one that does not leak."""


def closures_table(
    series: Sequence[xr.Dataset],
    trajectories: Sequence[xr.Dataset],
    cells: Sequence[xr.Dataset],
    start: float,
    seed: int,
) -> pd.DataFrame:
    """Tabulate what clouds of one volume fraction do, whose closure and box differ.

    Parameters: `series`, `trajectories` and `cells` (as `voronoi.cell_volumes` returns them) of the
    same runs, `start` of the window [tau] that all but the first two panels are averaged over,
    `seed` of the bootstrap.

    Returns the columns panel, model, n, box [d_p], x, y, low, high. Panels: "mean" and "variance"
    of the settling velocity over time [tau], "voronoi" (p.d.f. of normalised cell volumes), "pairs"
    (pair distribution over distance [d_p]) and "spectrum" (E over kappa, all particles), with 95 %
    intervals for "voronoi" and "pairs".

    Raises ValueError where the volume fractions differ, or as the parts do.
    """
    phis = {case_of(run)["volume_fraction"] for run in series}
    if len(phis) != 1:
        raise ValueError(f"closures are compared at one volume fraction, not {sorted(phis)}")
    time = settling_in_time(series)
    spectra = pd.concat([_named(cloud_spectra([run], start), run) for run in trajectories])
    spectra = spectra[(spectra["method"] == SPECTRUM) & (spectra["panel"] == "spectrum")]
    volumes = pd.concat(
        [_named(volume_distribution(pooled_volumes([run]), seed), run) for run in cells]
    )
    panels = {
        "mean": time.rename(columns={"time": "x", "mean": "y"}),
        "variance": time.rename(columns={"time": "x", "variance": "y"}),
        "voronoi": volumes.rename(columns={"volume": "x", "density": "y"}),
        "pairs": pair_distribution_table(trajectories, start).rename(
            columns={"distance": "x", "density": "y"}
        ),
        "spectrum": spectra,
    }
    box = {case_of(run)["n"]: float(run["cell_lengths"][0, 0]) for run in trajectories}
    columns = ["panel", *CASE, "x", "y", "low", "high"]
    table = pd.concat(
        [part.assign(panel=name).reindex(columns=columns) for name, part in panels.items()]
    )
    table.insert(3, "box", table["n"].map(box))
    return table.reset_index(drop=True)


def _named(table: pd.DataFrame, run: xr.Dataset) -> pd.DataFrame:
    """The table with the columns that tell its run from the others."""
    return table.assign(**{name: case_of(run)[name] for name in CASE})
