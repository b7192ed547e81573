"""Draw phase diagrams and energy spectra of the tracked particles."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.spectra import phase_and_spectra
from dustfall.figures.settling import phase_and_spectra as draw
from dustfall.figures.style import save

joblog.start(snakemake)

params = snakemake.params
runs = [xr.load_dataset(path) for path in snakemake.input.series]
table = phase_and_spectra(
    runs,
    params.statistics_from,
    params.fit_frequencies,
    units=params.units,
    method=params.spectrum,
)
save(draw(table), table, Path(snakemake.output.png).with_suffix(""))
