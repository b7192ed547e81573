"""Draw what clouds do whose closure and box differ."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.closures import closures_table
from dustfall.figures.closures import closures
from dustfall.figures.style import save

joblog.start(snakemake)

given, params = snakemake.input, snakemake.params
series, trajectories, cells = (
    [xr.open_dataset(path) for path in paths]
    for paths in (given.series, given.trajectories, given.cells)
)
table = closures_table(series, trajectories, cells, params.statistics_from, params.seed)
save(closures(table), table, Path(snakemake.output.png).with_suffix(""))
