"""Strain the Stokes solver where its numbers could break, and write down what they did."""

import pandas as pd

import joblog
from dustfall.benchmarks import stress
from dustfall.files import atomic

progress = joblog.start(snakemake)

tolerances = snakemake.params.tolerances
table = pd.concat(
    [
        stress.gaps(tolerances, progress=progress("gaps", "solves")),
        stress.crowds(tolerances, progress=progress("crowds", "solves")),
        stress.distances(tolerances),
        stress.invariances(tolerances),
        stress.turned_mesh(),
        stress.condition_numbers(),
    ]
)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
