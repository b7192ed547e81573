"""Measure run time against error of every method for spheres that move."""

from pathlib import Path

import joblog
from dustfall.benchmarks.moving import EXACT, all_spheres, moving, moving_methods, moving_sets
from dustfall.benchmarks.solver import time_against_error
from dustfall.figures.benchmark import solver_benchmark
from dustfall.figures.style import save

progress = joblog.start(snakemake)
params = snakemake.params

tolerances = [t for t in params.tolerances if t > EXACT]
# Near contact a scene takes seconds by methods that are quick for fixed spheres.
scenes = max(params.few, params.scenes // 5)
table = time_against_error(
    moving_sets(scenes, params.seed),
    moving_methods(tolerances, scenes, params.few),
    progress=progress("benchmark", "rows"),
    exact=moving(EXACT),
    compare=all_spheres,
)
print(table.to_string(index=False))
figure = solver_benchmark(table, "error of a force")
save(figure, table, Path(snakemake.output.error).with_suffix(""))
