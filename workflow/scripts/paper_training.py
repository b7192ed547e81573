"""Train the IDNN as the paper does, and write down how its error falls."""

import joblog
from dustfall.analysis.evaluation import training_history
from dustfall.dataset import read, split
from dustfall.files import atomic
from dustfall.training.fit import PAPER_LAYERS, PAPER_SETTINGS, train_model

progress = joblog.start(snakemake)
params = snakemake.params

training, test = split(read(snakemake.input.data), params.test_share, params.seed)
training, test = training.of_laws(params.laws), test.of_laws(params.laws)
model = train_model(
    "idnn",
    training.neighbours,
    training.force,
    PAPER_LAYERS,
    PAPER_SETTINGS,
    params.seed,
    radial_input="distance",
    device=params.device,
    progress=progress(f"idnn {PAPER_LAYERS}, {len(training)} scenes", "epochs"),
    weight=training.weight,
)
table = training_history(model, test)
print(table.groupby("component").last().to_string())
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
