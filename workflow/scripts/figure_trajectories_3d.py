"""Draw the paths of the tracked particles in space."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.settling import tracked_trajectories
from dustfall.figures.settling import trajectories_3d
from dustfall.figures.style import save

joblog.start(snakemake)

table = tracked_trajectories(xr.load_dataset(path) for path in snakemake.input.series)
save(trajectories_3d(table), table, Path(snakemake.output.png).with_suffix(""))
