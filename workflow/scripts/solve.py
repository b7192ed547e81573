"""Solve the Stokes problem of every scene of a shard and record the forces."""

import numpy as np

import joblog
from dustfall.stokes.many_body import CONVERGED
from dustfall.stokes.one_body import OneBody
from dustfall.stokes.records import read_plans, solve_shard, write_records

progress = joblog.start(snakemake.log[0])

plans, scene = read_plans(snakemake.input.meshes)
bodies = [OneBody.load(path) for path in snakemake.input.operators]
records = solve_shard(
    plans, bodies, snakemake.params.tolerance, progress("Stokes solves", "scenes")
)
write_records(snakemake.output[0], records, scene)

failed = np.flatnonzero(records["status"] != CONVERGED)
print(f"{len(plans) - len(failed)} of {len(plans)} scenes converged")
for k in failed:
    print(
        f"scene {scene[k]} did not converge: residual {records['residual'][k]:.1e}, "
        f"smallest gap {records['minimum_gap'][k]:.1e} d_p"
    )
