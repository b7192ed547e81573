"""Draw predicted against target force of each learned model."""

from pathlib import Path

import h5py

import joblog
from dustfall.analysis.correlations import predictions_against_target
from dustfall.figures.forces import predicted_vs_target
from dustfall.figures.style import save

joblog.start(snakemake.log[0])

names = {"idnn": "IDNN", "dense": "dense ANN", "anchored": "anchored IDNN"}
with h5py.File(snakemake.input.predictions) as file:
    own = file["radial_law"][()].astype(str) == snakemake.params.radial_law
    target = file["target"][()][own]
    predictions = {title: file[name][()][own] for name, title in names.items()}
table = predictions_against_target(target, predictions, snakemake.params.samples)
save(predicted_vs_target(table), table, Path(snakemake.output.png).with_suffix(""))
