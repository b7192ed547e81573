"""Drag on an isolated sphere against mesh size, with observed orders and convergence index."""

import joblog
from dustfall.benchmarks.mesh_study import convergence_table, mesh_study
from dustfall.files import atomic

progress = joblog.start(snakemake)

study = mesh_study(snakemake.params.sizes, progress("mesh study", "meshes"))
convergence = convergence_table(study)
print(convergence.to_string(index=False))
for table, target in ((study, snakemake.output.study), (convergence, snakemake.output.convergence)):
    with atomic(target) as path:
        table.to_csv(path, index=False)
