"""Strain the Stokes solver where its numbers could break, and write down what they did."""

import pandas as pd

import joblog
from dustfall.benchmarks import stress
from dustfall.files import atomic
from dustfall.stokes.plan import SMALLEST_TOLERANCE

progress = joblog.start(snakemake)

params = snakemake.params
tolerances = params.tolerances
table = pd.concat(
    [
        stress.gaps(tolerances, progress=progress("gaps", "solves")),
        stress.crowds(
            sorted({*tolerances, SMALLEST_TOLERANCE}, reverse=True),
            params.crowds,
            params.seed,
            progress("crowds", "solves"),
        ),
        stress.distances(tolerances),
        stress.invariances(tolerances),
        stress.turned_mesh(),
        stress.condition_numbers(),
    ]
)
# Of the crowds, which are thousands of rows, the file alone has all.
print(table[table["test"] != "crowd"].to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
