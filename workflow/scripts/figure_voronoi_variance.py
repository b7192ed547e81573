"""Draw the variance of Voronoï volumes against the steady settling velocity."""

from pathlib import Path

import pandas as pd
import xarray as xr

import joblog
from dustfall.analysis.voronoi import voronoi_variance_table
from dustfall.figures.style import save
from dustfall.figures.voronoi import voronoi_variance

joblog.start(snakemake)

params = snakemake.params
steady = pd.read_csv(snakemake.input.steady)
steady = steady[steady["quantity"] == "settling_velocity_mean"]
spheres = pd.read_csv(snakemake.input.spheres)
cells = [xr.open_dataset(path) for path in snakemake.input.cells]
table = voronoi_variance_table(cells, steady, spheres, params.seed)
save(voronoi_variance(table), table, Path(snakemake.output.png).with_suffix(""))
