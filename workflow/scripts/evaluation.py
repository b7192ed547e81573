"""Compare the force models on the test scenes, which no model was trained or chosen on."""

import h5py
import numpy as np

import joblog
from dustfall.analysis.evaluation import scores, symmetry_violations
from dustfall.dataset import read, split
from dustfall.files import atomic
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.learned import load_model

joblog.start(snakemake.log[0])
params = snakemake.params

_, test = split(read(snakemake.input.data), params.test_share, params.seed)
# Records are sorted by distance; a model that leans on the order must not be told it.
order = np.random.default_rng(params.seed).random((len(test), 5)).argsort(axis=1)
neighbours = np.take_along_axis(test.neighbours, order[:, :, None], axis=1)
models = [*map(load_model, snakemake.input.models), *(formula() for formula in FORMULAS.values())]
predictions = {model.name: model.predict(neighbours) for model in models}

for table, output in (
    (scores(predictions, test), snakemake.output.table),
    (symmetry_violations(models, neighbours), snakemake.output.symmetries),
):
    print(table.to_string(index=False))
    with atomic(output) as path:
        table.to_csv(path, index=False)
with atomic(snakemake.output.predictions) as path, h5py.File(path, "w") as file:
    for name, values in {"target": test.force, **predictions}.items():
        file.create_dataset(name, data=values, track_times=False).attrs["unit"] = "Re_p c_D"
    gap = np.linalg.norm(test.neighbours, axis=2).min(axis=1) - 1.0
    file.create_dataset("gap", data=gap, track_times=False).attrs["unit"] = "d_p"
    file.create_dataset("volume_fraction", data=test.volume_fraction, track_times=False)
    file.create_dataset("radial_law", data=test.radial_law.astype(bytes), track_times=False)
