"""Measure run time against error of the Stokes solver on random scenes."""

import joblog
from dustfall.files import atomic
from dustfall.scenes import random_scenes
from dustfall.stokes.benchmark import time_against_error
from dustfall.stokes.one_body import OneBody

progress = joblog.start(snakemake.log[0])
params = snakemake.params

neighbours, phi = random_scenes(
    params.seed, params.law, range(params.scenes), (params.phi_min, params.phi_max)
)
body = OneBody.load(snakemake.input.operator)
table = time_against_error(
    neighbours, phi, body, params.tolerances, progress=progress("benchmark", "rows")
)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
