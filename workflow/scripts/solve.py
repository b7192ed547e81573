"""Solve the Stokes problem of every scene of a shard and record the forces."""

import numpy as np

import joblog
from dustfall.columns import read_columns
from dustfall.scenes import SCENE_COLUMNS
from dustfall.solution import Status
from dustfall.stokes.records import solve_shard, write_records

progress = joblog.start(snakemake)

shard = read_columns(snakemake.input.scenes, SCENE_COLUMNS)
tolerance, scene = snakemake.params.tolerance, shard["scene"]
bar = progress("Stokes solves", "scenes")
records = solve_shard(shard["neighbours"], tolerance, bar, snakemake.params.method)
write_records(snakemake.output[0], records, scene)

for k in np.flatnonzero(records["status"] != Status.CONVERGED):
    print(
        f"scene {scene[k]} is {records['status'][k]}: residual {records['residual'][k]:.1e}, error "
        f"estimate {records['error_estimate'][k].max():.1e}, smallest gap "
        f"{records['minimum_gap'][k]:.1e} d_p"
    )
highest = records["degrees"].max(axis=(1, 2))
print(f"{len(scene)} scenes by {snakemake.params.method}")
if highest.any():
    print(f"degree of the closest pair: {highest.min()} to {highest.max()}")
print(f"{np.sum(records['status'] == Status.CONVERGED)} converged")
