"""Make a movie of a slab of a settling cloud, coloured by velocity."""

import xarray as xr

import joblog
from dustfall.figures.movie import save_movie

progress = joblog.start(snakemake)

save_movie(
    xr.open_dataset(snakemake.input.trajectory),
    snakemake.output[0],
    snakemake.params.pictures,
    progress=progress("movie", "pictures"),
)
