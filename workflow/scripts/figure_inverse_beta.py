"""Draw the steady settling velocity against volume fraction."""

from pathlib import Path

import pandas as pd

import joblog
from dustfall.analysis.settling import inverse_beta_table
from dustfall.figures.settling import inverse_beta
from dustfall.figures.style import save

joblog.start(snakemake)

steady = pd.read_csv(snakemake.input.steady)
table = inverse_beta_table(steady)
save(inverse_beta(table), table, Path(snakemake.output.png).with_suffix(""))
