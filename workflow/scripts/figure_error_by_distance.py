"""Draw the error of the force models against the gap to the nearest neighbour."""

from pathlib import Path

import h5py

import joblog
from dustfall.analysis.evaluation import error_by_gap
from dustfall.figures.forces import error_by_distance
from dustfall.figures.style import save

joblog.start(snakemake.log[0])

names = {
    "dense": "dense ANN",
    "idnn": "IDNN",
    "rotne_prager": "Rotne-Prager",
    "reflections": "reflections",
    "anchored": "anchored IDNN",
}
with h5py.File(snakemake.input.predictions) as file:
    predictions = {title: file[name][()] for name, title in names.items()}
    table = error_by_gap(predictions, file["target"][()], file["gap"][()])
save(error_by_distance(table), table, Path(snakemake.output.png).with_suffix(""))
