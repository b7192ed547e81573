"""Average the series of every case over its steady state, with confidence intervals."""

import pandas as pd
import xarray as xr

import joblog
from dustfall.analysis.settling import steady_state
from dustfall.files import atomic

joblog.start(snakemake.log[0])

quantities = [
    "settling_velocity_mean",
    "settling_velocity_variance",
    "inverse_beta_mean",
    "drag_mean",
    "new_neighbours",
]
runs = [xr.load_dataset(path) for path in snakemake.input.series]
start = snakemake.params.statistics_from
table = pd.concat([steady_state(runs, start, quantity) for quantity in quantities])
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
