"""Take a data set of one's own into the campaign, with its summary table."""

import hashlib
from pathlib import Path

import dustfall
import joblog
from dustfall.dataset import summary, write
from dustfall.files import atomic
from dustfall.own_data import read_own_data

joblog.start(snakemake)

source = Path(snakemake.input.file)
dataset, reynolds = read_own_data(source)
provenance = {
    "made_by": f"dustfall {dustfall.__version__}",
    "source": source.name,
    "source_sha256": hashlib.sha256(source.read_bytes()).hexdigest(),
}
if reynolds is not None:
    provenance["reynolds_range"] = [reynolds.min(), reynolds.max()]
write(snakemake.output.data, dataset, provenance)
table = summary(dataset)
print(table.to_string(index=False))
with atomic(snakemake.output.summary) as path:
    table.to_csv(path, index=False)
