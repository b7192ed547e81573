"""Let the particles of one case settle, all of them coupled through the fluid."""

import joblog
from dustfall.sedimentation.closures.all_particles import AllParticles
from settling import properties_of, settle_case

progress, params = joblog.start(snakemake), snakemake.params
properties = properties_of(params)
closure = AllParticles(
    properties,
    params.schedule["step"],
    fluid=params.fluid,
    tolerance=params.tolerance,
    threads=snakemake.threads,
)
settle_case(snakemake, closure, properties, progress)
