"""Choose the template at every centre and the coupling of every pair of a shard's scenes."""

import h5py
import numpy as np

import joblog
from dustfall.stokes.many_body import NEAR
from dustfall.stokes.records import plan_shard, write_plans

joblog.start(snakemake.log[0])

sizes = []
for template in snakemake.input.templates:
    with h5py.File(template) as file:
        sizes.append(float(file.attrs["edge_length"]))
with h5py.File(snakemake.input.scenes) as file:
    neighbours, scene = file["neighbours"][:], file["scene"][:]

plans = plan_shard(neighbours, sizes, snakemake.params.tolerance)
write_plans(snakemake.output[0], plans, scene, sizes)
near = sum(np.any(plan.orders == NEAR) for plan in plans)
print(f"{len(plans)} scenes, {near} of them with a pair to integrate element by element")
