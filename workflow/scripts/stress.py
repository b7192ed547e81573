"""Strain the Stokes solver where its numbers could break, and write down what they did."""

import pandas as pd

import joblog
from dustfall.benchmarks import stress
from dustfall.files import atomic
from dustfall.stokes.elements.one_body import OneBody

progress = joblog.start(snakemake.log[0])

body, tolerances = OneBody.load(snakemake.input.operator), snakemake.params.tolerances
table = pd.concat(
    [
        stress.gaps(body, tolerances, progress=progress("gaps", "solves")),
        stress.distances(body, tolerances),
        stress.invariances(body, tolerances),
        stress.turned_mesh(),
        stress.condition_numbers(),
    ]
)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
