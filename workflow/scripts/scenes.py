"""Draw the random scenes of one shard."""

import h5py
import numpy as np

import joblog
from dustfall.files import atomic
from dustfall.scenes import random_scenes

joblog.start(snakemake.log[0])
params = snakemake.params

numbers = np.arange(*params.numbers)
neighbours, phi = random_scenes(
    params.seed, snakemake.wildcards.law, numbers, (params.phi_min, params.phi_max)
)
with atomic(snakemake.output[0]) as path, h5py.File(path, "w") as file:
    for name, values, unit in (
        ("neighbours", neighbours, "d_p"),
        ("volume_fraction", phi, "1"),
        ("scene", numbers, "1"),
    ):
        file.create_dataset(name, data=values, track_times=False).attrs["unit"] = unit
print(f"{len(numbers)} scenes, phi from {phi.min():.3g} to {phi.max():.3g}")
