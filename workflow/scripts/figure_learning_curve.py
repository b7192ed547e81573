"""Draw what force models leave unexplained against the number of training scenes."""

from pathlib import Path

import pandas as pd

import joblog
from dustfall.figures.forces import learning_curve
from dustfall.figures.style import save

joblog.start(snakemake)

table = pd.read_csv(snakemake.input.table)
save(learning_curve(table), table, Path(snakemake.output.png).with_suffix(""))
