"""Solve the Stokes problem of every scene of a shard and record the forces."""

import numpy as np

import joblog
from dustfall.stokes.elements.one_body import OneBody
from dustfall.stokes.records import read_plans, solve_shard, write_records
from dustfall.stokes.solve import NOT_CONVERGED, OUT_OF_REACH, one_body_response

progress = joblog.start(snakemake.log[0])

plans, scene = read_plans(snakemake.input.meshes)
tolerance = snakemake.params.tolerance
response = one_body_response(OneBody.load(snakemake.input.operator), tolerance)
records = solve_shard(plans, response, tolerance, progress("Stokes solves", "scenes"))
write_records(snakemake.output[0], records, scene)

sentences = {NOT_CONVERGED: "did not converge", OUT_OF_REACH: "is not resolved to the tolerance"}
for status, sentence in sentences.items():
    for k in np.flatnonzero(records["status"] == status):
        print(
            f"scene {scene[k]} {sentence}: residual {records['residual'][k]:.1e}, error estimate "
            f"{records['error_estimate'][k].max():.1e}, smallest gap "
            f"{records['minimum_gap'][k]:.1e} d_p"
        )
print(f"{len(plans)} scenes, {np.sum(records['status'] != NOT_CONVERGED)} converged")
