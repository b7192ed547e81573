"""Let the particles of one case settle, all of them coupled through the fluid."""

from dustfall.sedimentation.closures.all_particles import AllParticles
from settling import properties_of, settle_case

params = snakemake.params
properties = properties_of(params)
closure = AllParticles(
    properties,
    params.step,
    fluid=params.fluid,
    tolerance=params.tolerance,
    threads=snakemake.threads,
)
settle_case(snakemake, closure, properties)
