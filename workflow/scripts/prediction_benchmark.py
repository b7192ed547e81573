"""Time the prediction of every force model, and draw its score against it."""

from pathlib import Path

import pandas as pd

import joblog
from dustfall.benchmarks.cost import prediction_cost
from dustfall.dataset import read
from dustfall.figures.forces import accuracy_vs_cost
from dustfall.figures.style import save
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.learned import load_model

joblog.start(snakemake)

neighbours = read(snakemake.input.data).neighbours
models = [*map(load_model, snakemake.input.models), *FORMULAS.values()]
cost = {model.name: prediction_cost(model, neighbours) for model in models}

scores = pd.read_csv(snakemake.input.scores)
scores = scores[scores["radial_law"] == snakemake.params.radial_law]
# The first rows of a law are those of all its decades.
table = scores.groupby(["model", "component"], sort=False).head(1)
table = table.assign(microseconds=table["model"].map(cost))
print(table.to_string(index=False))
save(accuracy_vs_cost(table), table, Path(snakemake.output.png).with_suffix(""))
