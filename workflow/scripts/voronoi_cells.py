"""Measure the Voronoï cells in some frames of a case."""

import xarray as xr

import joblog
from dustfall.analysis.voronoi import cell_volumes
from dustfall.files import atomic

progress = joblog.start(snakemake)

params = snakemake.params
with xr.open_dataset(snakemake.input.trajectory) as trajectory:
    cells = cell_volumes(
        trajectory,
        params.statistics_from,
        params.snapshots,
        progress(snakemake.wildcards.case, "frames"),
    )
with atomic(snakemake.output[0]) as path:
    cells.to_netcdf(path)
