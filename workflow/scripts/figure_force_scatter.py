"""Draw the force components of the data set against volume fraction."""

from pathlib import Path

import joblog
from dustfall.analysis.distributions import force_samples
from dustfall.dataset import read
from dustfall.figures.forces import force_scatter
from dustfall.figures.style import save

joblog.start(snakemake)

data = read(snakemake.input.data)
data = data.select(data.radial_law == snakemake.params.radial_law)
table = force_samples(data.volume_fraction, data.force, snakemake.params.samples)
save(force_scatter(table), table, Path(snakemake.output.png).with_suffix(""))
