"""Compare forces in frozen random clouds: from few neighbours, and from all particles."""

from pathlib import Path

import joblog
from dustfall.analysis.frozen_cloud import frozen_cloud_table
from dustfall.figures.frozen_cloud import frozen_cloud
from dustfall.figures.style import save

progress = joblog.start(snakemake)

params = snakemake.params
table = frozen_cloud_table(
    params.volume_fractions,
    params.particles,
    params.clouds,
    params.seed,
    progress=progress("frozen clouds", "clouds"),
)
save(frozen_cloud(table), table, Path(snakemake.output.png).with_suffix(""))
