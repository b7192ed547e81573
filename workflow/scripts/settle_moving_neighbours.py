"""Let a cloud settle among neighbours that move each in its own way, or as one."""

import joblog
from dustfall.forces.formula import load_formula
from dustfall.sedimentation.closures.moving_neighbours import MovingNeighbours
from dustfall.sedimentation.closures.nearest_neighbours import NearestNeighbours
from settling import properties_of, settle_case

progress, params = joblog.start(snakemake), snakemake.params
properties = properties_of(params)
closure = (
    MovingNeighbours(properties, params.schedule["step"], threads=snakemake.threads)
    if params.moving
    else NearestNeighbours(load_formula(params.model), threads=snakemake.threads)
)
settle_case(snakemake, closure, properties, progress)
