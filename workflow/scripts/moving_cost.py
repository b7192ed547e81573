"""Measure what the velocities of spheres that settle cost, to the largest number of them."""

import joblog
from dustfall.benchmarks.moving_estimates import cost
from dustfall.files import atomic

joblog.start(snakemake)

table = cost(snakemake.params.spheres, seed=snakemake.params.seed)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
