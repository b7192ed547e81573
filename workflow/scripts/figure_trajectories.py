"""Draw the paths of the tracked particles from the side and from above."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.settling import tracked_trajectories
from dustfall.figures.settling import trajectories
from dustfall.figures.style import save

joblog.start(snakemake)

table = tracked_trajectories(xr.load_dataset(path) for path in snakemake.input.series)
save(trajectories(table), table, Path(snakemake.output.png).with_suffix(""))
