"""Compare runs of one small cloud that differ in their time step alone."""

import xarray as xr

import joblog
from dustfall.analysis.step_size import step_size_table
from dustfall.files import atomic

joblog.start(snakemake)

runs = [xr.load_dataset(path) for path in snakemake.input.series]
params = snakemake.params
with atomic(snakemake.output[0]) as path:
    step_size_table(runs, params.statistics_from, params.together).to_csv(path, index=False)
