"""Draw the p.d.f. of the force in each decade of phi, and tabulate what the paper states of it."""

from pathlib import Path

import joblog
from dustfall.analysis.distributions import force_distributions, force_summary
from dustfall.dataset import read
from dustfall.figures.forces import force_pdf
from dustfall.figures.style import save
from dustfall.files import atomic

joblog.start(snakemake.log[0])

data = read(snakemake.input.data)
data = data.select(data.radial_law == snakemake.params.radial_law)
table = force_distributions(data.volume_fraction, data.force)
save(force_pdf(table), table, Path(snakemake.output.png).with_suffix(""))

with atomic(snakemake.output.summary) as path:
    force_summary(data.volume_fraction, data.force).to_csv(path, index=False)
