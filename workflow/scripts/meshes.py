"""Place the template in a shard's scenes and choose the harmonics that every pair exchanges."""

import h5py

import joblog
from dustfall.stokes.records import plan_shard, write_plans

joblog.start(snakemake.log[0])

with h5py.File(snakemake.input.template) as file:
    template = {
        "template_edge": file.attrs["edge_length"],
        "template_elements": len(file["triangles"]),
    }
with h5py.File(snakemake.input.scenes) as file:
    neighbours, scene = file["neighbours"][:], file["scene"][:]

plans = plan_shard(neighbours, snakemake.params.tolerance)
write_plans(snakemake.output[0], plans, scene, template)
highest = [plan.orders.max() for plan in plans]
print(f"{len(plans)} scenes; degree of the closest pair: {min(highest)} to {max(highest)}")
