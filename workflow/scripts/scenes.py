"""Draw the random scenes of one shard."""

import numpy as np

import joblog
from dustfall.columns import write_columns
from dustfall.scenes import SCENE_COLUMNS, random_scenes

joblog.start(snakemake)
params = snakemake.params

numbers = np.arange(*params.numbers)
neighbours, phi = random_scenes(
    params.seed,
    snakemake.wildcards.law,
    numbers,
    (params.phi_min, params.phi_max),
    params.neighbours,
)
values = {"neighbours": neighbours, "volume_fraction": phi, "scene": numbers}
write_columns(snakemake.output[0], SCENE_COLUMNS, values)
print(f"{len(numbers)} scenes, phi from {phi.min():.3g} to {phi.max():.3g}")
