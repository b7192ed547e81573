"""Compare runs of a small cloud whose neighbours move as one or each in its own way."""

import xarray as xr

import joblog
from dustfall.analysis.moving_neighbours import moving_neighbours_table
from dustfall.files import atomic

joblog.start(snakemake)

runs = (
    (xr.load_dataset(series), xr.load_dataset(trajectory))
    for series, trajectory in zip(snakemake.input.series, snakemake.input.trajectory, strict=True)
)
table = moving_neighbours_table(runs, snakemake.params.start)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
