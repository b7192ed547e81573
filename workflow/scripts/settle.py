"""Let the particles of one case settle among their nearest neighbours."""

import joblog
from dustfall.forces.formula import load_formula
from dustfall.forces.learned import load_model
from dustfall.sedimentation.closures.nearest_neighbours import NearestNeighbours
from settling import properties_of, settle_case

progress = joblog.start(snakemake)
learned = snakemake.input.model
model = load_model(learned) if learned else load_formula(snakemake.params.model)
number = snakemake.params.get("neighbours")
closure = NearestNeighbours(model, number, threads=snakemake.threads)
settle_case(snakemake, closure, properties_of(snakemake.params), progress)
