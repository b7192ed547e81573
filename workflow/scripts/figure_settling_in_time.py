"""Draw mean and variance of the settling velocity in time."""

from pathlib import Path

import pandas as pd
import xarray as xr

import joblog
from dustfall.analysis.settling import settling_in_time
from dustfall.figures.settling import WINDOWS
from dustfall.figures.settling import settling_in_time as draw
from dustfall.figures.style import save

joblog.start(snakemake)

runs = dict(zip(WINDOWS, (snakemake.input.series, snakemake.input.long), strict=True))
tables = [
    settling_in_time(map(xr.load_dataset, paths)).assign(window=window)
    for window, paths in runs.items()
    if paths
]
table = pd.concat(tables, ignore_index=True)
save(draw(table), table, Path(snakemake.output.png).with_suffix(""))
