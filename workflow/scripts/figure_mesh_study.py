"""Draw the drag on an isolated sphere against mesh size, beside the paper's points."""

from pathlib import Path

import pandas as pd

import joblog
from dustfall.analysis.mesh_study import mesh_study_table
from dustfall.figures.mesh import mesh_study
from dustfall.figures.style import save

joblog.start(snakemake)

table = mesh_study_table(pd.read_csv(snakemake.input.study))
save(mesh_study(table), table, Path(snakemake.output.png).with_suffix(""))
