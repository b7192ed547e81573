"""Train one force model on both components."""

import json
from pathlib import Path

import joblog
from dustfall.dataset import read, split
from dustfall.training.fit import TrainingSettings, train_model

progress = joblog.start(snakemake)
params = snakemake.params
kind = snakemake.wildcards.model

training, _ = split(read(snakemake.input.data), params.test_share, params.seed)
training = training.of_laws(params.laws)
layers = params.layers or json.loads(Path(snakemake.input.winner).read_text())["layers"]
model = train_model(
    kind,
    training.neighbours,
    training.force,
    layers,
    TrainingSettings(**params.training),
    params.seed,
    radial_input=params.radial_input,
    device=params.device,
    progress=progress(f"{kind} {layers}", "epochs"),
    weight=training.weight,
)
model.header["training"]["command"] = f"snakemake -- {snakemake.output[0]}"
print(json.dumps(model.header, indent=2))
model.save(snakemake.output[0])
