"""Let the particles of one case settle, and write their trajectory and series."""

import hashlib
import shutil
from pathlib import Path

import joblog
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.learned import load_model
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import settle
from dustfall.sedimentation.start import read_start

progress = joblog.start(snakemake.log[0])
params, case = snakemake.params, snakemake.wildcards.case

learned = snakemake.input.model
model = load_model(learned) if learned else FORMULAS[params.model]()
properties = Properties(**params.properties)

positions = velocities = None
if snakemake.input.start:
    positions, velocities = read_start(
        snakemake.input.start, params.particles, params.volume_fraction
    )

# A killed run goes on from its checkpoint, unless a setting or a file has changed since.
state = hashlib.sha256(repr(sorted(params.items())).encode())
for file in (snakemake.input.model, snakemake.input.start):
    state.update(Path(file).read_bytes() if file else b"none")
state = state.hexdigest()[:16]
checkpoints = Path(snakemake.output.trajectory).parent / "checkpoints"
for stale in checkpoints.glob(f"{case}-*"):
    if stale.name != f"{case}-{state}":
        shutil.rmtree(stale)

done = settle(
    model,
    properties.with_galileo_multiple(params.galileo_multiple, params.change),
    params.particles,
    params.volume_fraction,
    params.step,
    params.duration,
    params.save_every,
    params.seed,
    snakemake.output.trajectory,
    snakemake.output.series,
    start=params.start,
    positions=positions,
    velocities=velocities,
    precision=params.precision,
    checkpoint=checkpoints / f"{case}-{state}",
    checkpoint_interval=snakemake.resources.checkpoint_interval,
    threads=snakemake.threads,
    progress=progress(case, "steps"),
)
print(f"{done['steps']} steps in {done['seconds']:.1f} s, {done['steps_per_second']:.3g} a second")
