"""Join the scores of trials in one table: all decades of each radial law."""

import pandas as pd

import joblog
from dustfall.files import atomic

joblog.start(snakemake)

tables = [pd.read_csv(path) for path in snakemake.input]
whole = [table.groupby(["radial_law", "component"], sort=False).head(1) for table in tables]
table = pd.concat(whole, ignore_index=True)
print(table.to_string(index=False))
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
