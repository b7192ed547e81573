"""Draw the error of the force models against the gap to the nearest neighbour."""

from pathlib import Path

import joblog
from dustfall.analysis.evaluation import error_by_gap, prediction_columns
from dustfall.columns import read_columns
from dustfall.figures.forces import error_by_distance
from dustfall.figures.style import save
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.registry import trained_models

joblog.start(snakemake)

models = [*FORMULAS, *trained_models()]
found = read_columns(snakemake.input.predictions, prediction_columns(models))
table = error_by_gap({model: found[model] for model in models}, found["target"], found["gap"])
save(error_by_distance(table), table, Path(snakemake.output.png).with_suffix(""))
