"""Train one force model on some of the training scenes, and score it on the test scenes."""

from dataclasses import asdict

import numpy as np

import joblog
from dustfall.analysis.evaluation import scores
from dustfall.dataset import read, split
from dustfall.files import atomic
from dustfall.forces.features import KINDS
from dustfall.streams import Purpose, stream
from dustfall.training.fit import TrainingSettings, train_model

progress = joblog.start(snakemake)
params, wildcards = snakemake.params, snakemake.wildcards

training, test = split(read(snakemake.input.data), params.test_share, params.seed)
training = training.of_laws(params.laws)
if wildcards.number != "all":
    # One order for all numbers: a larger set holds the smaller ones.
    order = stream(Purpose.LEARNING_CURVE, params.seed).permutation(len(training))
    training = training.select(np.sort(order[: int(wildcards.number)]))
model = train_model(
    wildcards.model,
    training.neighbours,
    training.force,
    params.layers,
    TrainingSettings(**params.training),
    params.seed,
    radial_input=params.radial_input,
    device=params.device,
    progress=progress(f"{wildcards.model} {params.layers}, {len(training)} scenes", "epochs"),
    weight=training.weight,
)
table = scores({model.name: model.predict(test.neighbours)}, test)
parameters = {component: network.parameters for component, network in model.networks.items()}
table = table.assign(
    **asdict(KINDS[model.name]),
    layers=params.layers,
    parameters=table["component"].map(parameters),
    training_scenes=len(training),
)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
