"""Compare the force models on the test scenes, which no model was trained or chosen on."""

import numpy as np

import joblog
from dustfall.analysis.evaluation import prediction_columns, scores, symmetry_violations
from dustfall.columns import write_columns
from dustfall.dataset import read, split
from dustfall.files import atomic
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.learned import load_model

joblog.start(snakemake)
params = snakemake.params

_, test = split(read(snakemake.input.data), params.test_share, params.seed)
models = [*map(load_model, snakemake.input.models), *FORMULAS.values()]
predictions = {model.name: model.predict(test.neighbours) for model in models}

for table, output in (
    (scores(predictions, test), snakemake.output.table),
    (symmetry_violations(models, test.neighbours), snakemake.output.symmetries),
):
    print(table.to_string(index=False))
    with atomic(output) as path:
        table.to_csv(path, index=False)
gap = np.linalg.norm(test.neighbours, axis=2).min(axis=1) - 1.0
values = {
    "target": test.force,
    "gap": gap,
    "volume_fraction": test.volume_fraction,
    "radial_law": test.radial_law,
    **predictions,
}
write_columns(snakemake.output.predictions, prediction_columns(predictions), values)
