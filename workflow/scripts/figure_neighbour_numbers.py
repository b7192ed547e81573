"""Draw the settling velocity against the number of neighbours, the paper's points beside it."""

from pathlib import Path

import pandas as pd

import joblog
from dustfall.figures.neighbours import neighbour_numbers
from dustfall.figures.style import save

joblog.start(snakemake)

table = pd.read_csv(snakemake.input.table)
save(neighbour_numbers(table), table, Path(snakemake.output.png).with_suffix(""))
