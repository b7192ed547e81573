"""Draw how far time averages of single particles are from the ensemble average."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.ergodicity import ergodicity_table
from dustfall.figures.fluctuations import ergodicity
from dustfall.figures.style import save

joblog.start(snakemake)

trajectories = [xr.open_dataset(path) for path in snakemake.input.trajectories]
table = ergodicity_table(trajectories, snakemake.params.starts)
save(ergodicity(table), table, Path(snakemake.output.png).with_suffix(""))
