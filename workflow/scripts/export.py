"""Put the frames of a trajectory into one file that ParaView opens."""

import joblog
from dustfall.sedimentation.export import export_vtkhdf

progress = joblog.start(snakemake)
export_vtkhdf(
    snakemake.input.trajectory,
    snakemake.output[0],
    folded=snakemake.params.positions == "folded",
    progress=progress(snakemake.wildcards.case, "frames"),
)
