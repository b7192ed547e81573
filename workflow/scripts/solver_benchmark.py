"""Measure run time against error of every method for the Stokes problem of a scene."""

from itertools import pairwise
from pathlib import Path

import numpy as np

import joblog
from dustfall.benchmarks.solver import methods, time_against_error, time_against_spheres
from dustfall.figures.benchmark import solver_benchmark
from dustfall.figures.style import save
from dustfall.files import atomic
from dustfall.scenes import random_scenes

progress = joblog.start(snakemake)
params = snakemake.params

low, high = np.log10([params.phi_min, params.phi_max])
edges = 10.0 ** np.append(np.arange(low, high - 1e-9), high)
sets = {}
for begin, end in pairwise(edges):
    name = f"phi from {np.format_float_scientific(begin, 0, trim='-', exp_digits=1)}"
    neighbours, _ = random_scenes(params.seed, "uniform", range(params.scenes), (begin, end))
    sets[name] = np.concatenate([np.zeros((params.scenes, 1, 3)), neighbours], axis=1)
neighbours, _ = random_scenes(params.seed, "contact", range(params.scenes), tuple(edges[-2:]))
sets["near contact"] = np.concatenate([np.zeros((params.scenes, 1, 3)), neighbours], axis=1)

compared = methods(params.tolerances, params.scenes, params.few)
table = time_against_error(sets, compared, progress=progress("benchmark", "rows"))
print(table.to_string(index=False))
save(solver_benchmark(table), table, Path(snakemake.output.error).with_suffix(""))

cost = time_against_spheres(params.spheres)
print(cost.to_string(index=False))
with atomic(snakemake.output.spheres) as path:
    cost.to_csv(path, index=False)
