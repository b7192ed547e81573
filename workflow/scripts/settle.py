"""Let the particles of one case settle, and write their trajectory and series."""

import hashlib
import shutil
from pathlib import Path

import joblog
from dustfall.forces.formula import load_formula
from dustfall.forces.learned import load_model
from dustfall.sedimentation.closures.nearest_neighbours import NearestNeighbours
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import Checkpoint, Output, Schedule, settle
from dustfall.sedimentation.start import random_start, read_start, start_from

progress = joblog.start(snakemake.log[0])
params, case = snakemake.params, snakemake.wildcards.case

learned = snakemake.input.model
model = load_model(learned) if learned else load_formula(params.model)
if snakemake.input.start:
    position, velocity = read_start(snakemake.input.start, params.particles, params.volume_fraction)
    start = start_from(
        position, params.volume_fraction, params.start if velocity is None else velocity
    )
else:
    start = random_start(
        params.particles, params.volume_fraction, params.seed, params.stream, params.start
    )
properties = Properties(**params.properties)
trajectory, series = map(Path, (snakemake.output.trajectory, snakemake.output.series))

# A killed run goes on from its checkpoint, unless a setting or a file has changed since.
state = hashlib.sha256(repr(sorted(params.items())).encode())
for file in (snakemake.input.model, snakemake.input.start):
    state.update(Path(file).read_bytes() if file else b"none")
checkpoint = trajectory.parent / "checkpoints" / f"{case}-{state.hexdigest()[:16]}"
for other in checkpoint.parent.glob(f"{case}-*"):
    if other != checkpoint:
        shutil.rmtree(other)

done = settle(
    NearestNeighbours(model, threads=snakemake.threads),
    start,
    properties.with_galileo_multiple(params.galileo_multiple, params.change),
    Schedule(params.step, params.duration, params.save_every),
    Output(
        trajectory,
        series,
        params.precision,
        params.seed,
        params.stream,
        {"seed": params.seed, "stream": params.stream, "start": params.start},
    ),
    Checkpoint(checkpoint, snakemake.resources.checkpoint_interval),
    progress(case, "steps"),
)
print(f"{done['steps']} steps in {done['seconds']:.1f} s, {done['steps_per_second']:.3g} a second")
