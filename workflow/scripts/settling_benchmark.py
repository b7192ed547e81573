"""Measure what a step of settling costs, from small clouds to large ones."""

import joblog
from dustfall.benchmarks.settling_cost import exponents, settling_cost
from dustfall.files import atomic

progress, params = joblog.start(snakemake), snakemake.params

table = settling_cost(
    params.particles,
    params.volume_fraction,
    params.threads,
    params.seed,
    progress("benchmark", "clouds"),
)
table = table.merge(exponents(table), on=["closure", "threads"])
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
