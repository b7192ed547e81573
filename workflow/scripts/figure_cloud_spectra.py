"""Draw energy spectra averaged over all particles, with and without a window."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.spectra import cloud_spectra
from dustfall.figures.fluctuations import cloud_spectra as draw
from dustfall.figures.style import save

joblog.start(snakemake)

params = snakemake.params
trajectories = [xr.open_dataset(path) for path in snakemake.input.trajectories]
table = cloud_spectra(trajectories, params.starts, params.fit_frequencies, units=params.units)
save(draw(table), table, Path(snakemake.output.png).with_suffix(""))
