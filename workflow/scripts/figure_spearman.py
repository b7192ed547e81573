"""Draw how neighbour coordinates and force correlate by rank."""

from pathlib import Path

import joblog
from dustfall.analysis.correlations import spearman_by_neighbours
from dustfall.dataset import read
from dustfall.figures.forces import spearman
from dustfall.figures.style import save

joblog.start(snakemake)

data = read(snakemake.input.data)
data = data.select(data.radial_law == snakemake.params.radial_law)
table = spearman_by_neighbours(data.neighbours, data.force)
save(spearman(table), table, Path(snakemake.output.png).with_suffix(""))
