"""Compare the drag that closures give spheres at random velocities with the solver's."""

import joblog
from dustfall.benchmarks.moving_spheres import moving_spheres
from dustfall.files import atomic

progress = joblog.start(snakemake)

params = snakemake.params
table = moving_spheres(
    params.volume_fractions, seed=params.seed, progress=progress("drag", "clouds")
)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
