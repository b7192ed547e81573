"""Draw the p.d.f. of Voronoï volumes at each Galileo number."""

from pathlib import Path

import xarray as xr

import joblog
from dustfall.analysis.voronoi import voronoi_pdf_table
from dustfall.figures.style import save
from dustfall.figures.voronoi import voronoi_pdf

joblog.start(snakemake)

params = snakemake.params
cells = [xr.open_dataset(path) for path in snakemake.input.cells]
table = voronoi_pdf_table(cells, params.seed)
save(voronoi_pdf(table), table, Path(snakemake.output.png).with_suffix(""))
