"""Tabulate the sweep and choose the configuration of layers that both components take."""

import json
from pathlib import Path

import pandas as pd

import joblog
from dustfall.files import atomic
from dustfall.forces.learned import multiplications
from dustfall.training.cross_validation import choose_winner

joblog.start(snakemake)

results = [json.loads(Path(path).read_text()) for path in snakemake.input.results]
winner = choose_winner(results, snakemake.params.choice)
folds = pd.concat(pd.DataFrame(result.pop("folds")).assign(**result) for result in results)
folds["r2"] = folds["r2"].astype(float)  # none where the force does not vary
folds["multiplications"] = [
    multiplications(*trial)
    for trial in folds[["kind", "layers", "component", "neighbours"]].itertuples(index=False)
]
table = folds.groupby(["component", "layers", "parameters", "multiplications"]).agg(
    mse_mean=("mse", "mean"),
    mse_deviation=("mse", "std"),
    r2_mean=("r2", "mean"),
    r2_deviation=("r2", "std"),
    epochs_mean=("epochs", "mean"),
)
table = table.reset_index().sort_values(["component", "mse_mean"], ascending=[False, True])
table["winner"] = table["layers"] == winner["layers"]
print(table.to_string(index=False))

with atomic(snakemake.output.table) as path:
    table.to_csv(path, index=False)
with atomic(snakemake.output.winner) as path:
    path.write_text(json.dumps(winner, indent=2) + "\n", encoding="utf-8")
