"""Average the series of every case that is steady, with confidence intervals."""

import xarray as xr

import joblog
from dustfall.analysis.settling import steady_state
from dustfall.files import atomic

joblog.start(snakemake)

quantities = [
    "settling_velocity_mean",
    "settling_velocity_variance",
    "inverse_beta_mean",
    "drag_mean",
    "new_neighbours",
    "box_reynolds",
    "memory_from",
]
runs = [xr.load_dataset(path) for path in snakemake.input.series]
table = steady_state(runs, snakemake.params.starts, quantities)
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
