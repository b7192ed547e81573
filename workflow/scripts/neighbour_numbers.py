"""Compare runs of small clouds that differ in the number of neighbours."""

import xarray as xr

import joblog
from dustfall.analysis.neighbour_numbers import neighbour_numbers_table
from dustfall.files import atomic

joblog.start(snakemake)

runs = (xr.load_dataset(path) for path in snakemake.input.series)
table = neighbour_numbers_table(runs, snakemake.params.starts)
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
