"""Draw mean and variance of the settling velocity in time."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.settling import settling_in_time
from dustfall.figures.settling import settling_in_time as draw
from dustfall.figures.style import save

joblog.start(snakemake)

table = settling_in_time(xr.load_dataset(path) for path in snakemake.input.series)
save(draw(table), table, Path(snakemake.output.png).with_suffix(""))
