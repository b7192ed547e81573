"""Solve a sample of the scenes by other methods and stop where the forces disagree."""

from pathlib import Path

import numpy as np
import pandas as pd

import joblog
from dustfall.benchmarks.audit import TOLERANCE, audit, audit_sample, require_agreement
from dustfall.columns import read_columns
from dustfall.dataset import SOLUTION_COLUMNS
from dustfall.files import atomic
from dustfall.scenes import SCENE_COLUMNS

progress, params = joblog.start(snakemake), snakemake.params
other = "multipole" if params.method == "elements" else "elements"
tolerance = max(params.tolerance, TOLERANCE)
# No method audits itself.
paper = 0 if params.method == "paper" else params.paper

found: dict[str, list] = {}
for scenes, solutions in zip(snakemake.input.scenes, snakemake.input.solutions, strict=True):
    shard = read_columns(scenes, SCENE_COLUMNS)
    own = read_columns(solutions, SOLUTION_COLUMNS)
    found.setdefault(Path(scenes).stem.split("-")[0], []).append((shard, own))

tables = []
for k, (law, shards) in enumerate(found.items()):
    scenes, records = (
        {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        for parts in zip(*shards, strict=True)
    )
    # The laws share the sample; the first of them take what is left over.
    for methods, number in (([other], params.number), (["paper"], paper)):
        share = number // len(found) + (k < number % len(found))
        drawn = audit_sample(law, scenes["volume_fraction"], share, params.seed)
        if len(drawn):
            picked = [{name: part[drawn] for name, part in of.items()} for of in (scenes, records)]
            bar = progress(f"Audit of {law} by {methods[0]}", "scenes")
            tables.append(audit(law, *picked, methods, tolerance, bar))
table = pd.concat(tables, ignore_index=True)
print(table.groupby(["radial_law", "method"])["excess"].describe().to_string())
require_agreement(table)
with atomic(snakemake.output[0]) as path:
    table.to_csv(path, index=False)
