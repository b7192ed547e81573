"""Summarise the forces of each radial law beside the paper's figures."""

import json

import numpy as np
import pandas as pd

import joblog
from dustfall.analysis.correlations import COORDINATES, spearman_by_neighbours
from dustfall.analysis.distributions import force_summary
from dustfall.dataset import OWN_LAW, read
from dustfall.files import atomic

joblog.start(snakemake)

data = read(snakemake.input.data)
summary = {}
for law in dict.fromkeys(data.radial_law):
    own = data.of_laws([law])
    correlations = [spearman_by_neighbours(own.neighbours, own.force, c) for c in COORDINATES]
    tables = {
        "forces": force_summary(own.volume_fraction, own.force),
        "spearman": pd.concat(correlations, ignore_index=True),
    }
    if law == OWN_LAW:
        # The paper states nothing of other data.
        tables["forces"] = tables["forces"].assign(paper=np.nan)
    summary[law] = {
        # JSON has no NaN: what the paper does not state is null.
        name: table.astype(object).replace({np.nan: None}).to_dict("records")
        for name, table in tables.items()
    }
    if law == snakemake.params.radial_law:
        with atomic(snakemake.output.forces) as path:
            tables["forces"].to_csv(path, index=False)
    print(law, tables["forces"].head(24).to_string(index=False), sep="\n")
with atomic(snakemake.output.json) as path:
    path.write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
