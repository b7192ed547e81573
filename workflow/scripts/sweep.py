"""Cross-validate one configuration of layers for one component."""

import json

import joblog
from dustfall.dataset import read, split
from dustfall.files import atomic
from dustfall.training.cross_validation import cross_validate
from dustfall.training.fit import TrainingSettings

progress = joblog.start(snakemake)
params = snakemake.params

training, _ = split(read(snakemake.input.data), params.test_share, params.seed)
training = training.of_laws(params.laws)
result = cross_validate(
    training.neighbours,
    training.force,
    snakemake.wildcards.component,
    params.layers,
    params.folds,
    TrainingSettings(**params.training),
    params.seed,
    radial_input=params.radial_input,
    device=params.device,
    progress=progress(f"{snakemake.wildcards.component} {params.layers}", "epochs"),
    weight=training.weight,
)
with atomic(snakemake.output[0]) as path:
    path.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
