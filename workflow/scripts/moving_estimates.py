"""Hold error estimates of spheres that move against errors that an independent method finds."""

import joblog
from dustfall.benchmarks.moving_estimates import coverage, judged
from dustfall.files import atomic

progress = joblog.start(snakemake)

params = snakemake.params
table = judged(params.scenes, seed=params.seed, progress=progress("clusters", "clusters"))
print(coverage(table).to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
