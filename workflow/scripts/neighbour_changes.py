"""Count how often the nearest neighbours change in the steady state."""

import xarray as xr

import joblog
from dustfall.analysis.neighbour_changes import neighbour_changes
from dustfall.files import atomic

joblog.start(snakemake)

runs = (xr.load_dataset(path) for path in snakemake.input.series)
with atomic(snakemake.output[0]) as path:
    neighbour_changes(runs, snakemake.params.starts).to_csv(path, index=False)
