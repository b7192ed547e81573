"""Tabulate the volume fraction around each particle, at the start and in the steady state."""

import xarray as xr

import joblog
from dustfall.analysis.pairs import local_volume_fraction_table
from dustfall.dataset import read
from dustfall.files import atomic

joblog.start(snakemake)

params, data = snakemake.params, snakemake.input.data
densest = read(data).volume_fraction.max() if data else params.densest
trajectories = [xr.open_dataset(path) for path in snakemake.input.trajectories]
table = local_volume_fraction_table(trajectories, params.starts, densest)
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
