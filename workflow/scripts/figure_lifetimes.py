"""Draw how long particles keep their velocity, and their place in a cluster."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.lifetimes import lifetimes_table
from dustfall.figures.closures import lifetimes
from dustfall.figures.style import save

progress = joblog.start(snakemake)

trajectories = [xr.open_dataset(path) for path in snakemake.input.trajectories]
table = lifetimes_table(trajectories, snakemake.params.starts, progress("lifetimes", "cases"))
save(lifetimes(table), table, Path(snakemake.output.png).with_suffix(""))
