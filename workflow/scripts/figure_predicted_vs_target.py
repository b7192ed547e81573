"""Draw predicted against target force of the paper's two networks and of the anchored one."""

from pathlib import Path

import joblog
from dustfall.analysis.correlations import predictions_against_target
from dustfall.analysis.evaluation import prediction_columns
from dustfall.columns import read_columns
from dustfall.figures.forces import predicted_vs_target
from dustfall.figures.style import save

joblog.start(snakemake)

models = ["idnn", "dense", "anchored"]
found = read_columns(snakemake.input.predictions, prediction_columns(models))
own = found["radial_law"] == snakemake.params.radial_law
predictions = {model: found[model][own] for model in models}
table = predictions_against_target(found["target"][own], predictions, snakemake.params.samples)
save(predicted_vs_target(table), table, Path(snakemake.output.png).with_suffix(""))
