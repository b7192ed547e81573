"""Draw how far the audit's forces differ from those on record."""

from pathlib import Path

import pandas as pd

import joblog
from dustfall.figures.audit import audit
from dustfall.figures.style import save

joblog.start(snakemake)

table = pd.read_csv(snakemake.input.audit)
save(audit(table), table, Path(snakemake.output.png).with_suffix(""))
