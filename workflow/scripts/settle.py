"""Let the particles of one case settle among their nearest neighbours."""

import joblog
from dustfall.forces.formula import load_formula
from dustfall.forces.learned import load_model
from dustfall.sedimentation.closures.back_flow import BackFlow
from dustfall.sedimentation.closures.nearest_neighbours import NearestNeighbours
from settling import properties_of, settle_case

progress = joblog.start(snakemake)
learned, params = snakemake.input.model, snakemake.params
model = load_model(learned) if learned else load_formula(params.model)
number, threads = params.get("neighbours"), snakemake.threads
if params.get("back_flow"):
    closure = BackFlow(model, params.volume_fraction, number, threads)
else:
    closure = NearestNeighbours(model, number, threads)
settle_case(snakemake, closure, properties_of(params), progress)
