"""Draw the p.d.f. of the force in slices about powers of ten of phi."""

from pathlib import Path

import joblog
from dustfall.analysis.distributions import force_distributions
from dustfall.dataset import read
from dustfall.figures.forces import force_pdf
from dustfall.figures.style import save

joblog.start(snakemake)

data = read(snakemake.input.data)
data = data.select(data.radial_law == snakemake.params.radial_law)
table = force_distributions(data.volume_fraction, data.force)
save(force_pdf(table), table, Path(snakemake.output.png).with_suffix(""))
