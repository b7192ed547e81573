"""Tabulate the volume fraction around each particle, at the start and in the steady state."""

import xarray as xr

import joblog
from dustfall.analysis.pairs import local_volume_fraction_table
from dustfall.files import atomic

joblog.start(snakemake)

params = snakemake.params
trajectories = [xr.open_dataset(path) for path in snakemake.input.trajectories]
table = local_volume_fraction_table(trajectories, params.starts, params.densest)
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
