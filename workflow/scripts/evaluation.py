"""Compare the force models on the test scenes, which no model was trained or chosen on."""

import h5py
import numpy as np
import pandas as pd

import joblog
from dustfall.analysis.correlations import coefficient_of_determination
from dustfall.analysis.distributions import decades
from dustfall.dataset import read, split
from dustfall.files import atomic
from dustfall.forces.features import COMPONENTS
from dustfall.forces.models import load_model
from dustfall.forces.rotne_prager import IsolatedStokes, RotnePrager

joblog.start(snakemake.log[0])
params = snakemake.params

_, test = split(read(snakemake.input.data), params.test_share, params.seed)
# Records are sorted by distance; a model that leans on the order must not be told it.
order = np.random.default_rng(params.seed).random((len(test), 5)).argsort(axis=1)
neighbours = np.take_along_axis(test.neighbours, order[:, :, None], axis=1)
models = [*map(load_model, snakemake.input.models), RotnePrager(), IsolatedStokes()]
predictions = {model.name: model.predict(neighbours) for model in models}

everything = (test.volume_fraction.min(), test.volume_fraction.max(), np.full(len(test), True))
rows = []
for low, high, inside in [everything, *decades(test.volume_fraction)]:
    for name, predicted in predictions.items():
        for component, columns in COMPONENTS.items():
            target, error = (
                test.force[inside][:, columns],
                (predicted - test.force)[inside][:, columns],
            )
            row = {"model": name, "component": component, "phi_low": low, "phi_high": high}
            row["samples"] = int(inside.sum())
            if np.ptp(target) > 0:
                row["r2"] = coefficient_of_determination(target, target + error)
            row["rms_error"] = np.sqrt((error**2).mean())
            row["largest_error"] = np.abs(error).max()
            rows.append(row)
table = pd.DataFrame(rows)
print(table.to_string(index=False))

with atomic(snakemake.output.table) as path:
    table.to_csv(path, index=False)
with atomic(snakemake.output.predictions) as path, h5py.File(path, "w") as file:
    for name, values in {"target": test.force, **predictions}.items():
        file.create_dataset(name, data=values, track_times=False).attrs["unit"] = "Re_p c_D"
    file.create_dataset("volume_fraction", data=test.volume_fraction, track_times=False)
