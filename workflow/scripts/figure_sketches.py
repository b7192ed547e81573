"""Draw the sketches of a scene, of the trained network and of a particle's own frame."""

from pathlib import Path

import joblog
from dustfall.analysis.sketches import sketches_table
from dustfall.figures.sketches import sketches
from dustfall.figures.style import save
from dustfall.forces import load_model

joblog.start(snakemake)

model = load_model(snakemake.input.model)
table = sketches_table(model.name, model.header["layers"], model.neighbours)
save(sketches(table), table, Path(snakemake.output.png).with_suffix(""))
