"""Measure the variance of Voronoï volumes among random spheres at each volume fraction."""

import joblog
from dustfall.analysis.voronoi import random_sphere_table
from dustfall.files import atomic

joblog.start(snakemake)

table = random_sphere_table(snakemake.params.volume_fractions, snakemake.params.seed)
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
