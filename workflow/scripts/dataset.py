"""Make the data set of forces and its summary table from the solved shards."""

from pathlib import Path

import dustfall
import joblog
from dustfall.dataset import Shard, aggregate, summary, write
from dustfall.files import atomic

joblog.start(snakemake)
params = snakemake.params

shards = [
    Shard(Path(scenes).stem.split("-")[0], scenes, solutions)
    for scenes, solutions in zip(snakemake.input.scenes, snakemake.input.solutions, strict=True)
]
dataset, solve = aggregate(shards, params.numbers)

left_out = solve[~solve["converged"]]
print(f"{len(dataset)} scenes, and {len(left_out)} left out because they did not converge")
if len(left_out):
    print(left_out.to_string(index=False))
if len(left_out) > params.unconverged_share * len(solve):
    raise RuntimeError(
        f"{len(left_out)} of {len(solve)} scenes did not converge, and "
        f"dataset.unconverged_share allows a share of {params.unconverged_share:g}"
    )

provenance = {
    "made_by": f"dustfall {dustfall.__version__}",
    "seed": params.seed,
    "phi_range": [params.phi_min, params.phi_max],
    "stokes_tolerance": params.tolerance,
    **{f"scenes_{law}": number for law, number in params.numbers.items()},
}
write(snakemake.output.data, dataset, provenance)
table = summary(dataset, solve)
print(table.to_string(index=False))
with atomic(snakemake.output.summary) as path:
    table.to_csv(path, index=False)
