"""Let the particles of one case settle, and write their trajectory and series."""

import hashlib
import shutil
from pathlib import Path

import joblog
from dustfall.forces.models import load_model
from dustfall.forces.rotne_prager import IsolatedStokes, RotnePrager
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import settle

progress = joblog.start(snakemake.log[0])
params, case = snakemake.params, snakemake.wildcards.case

if params.model == "isolated":
    model = IsolatedStokes()
elif params.model == "rotne_prager":
    model = RotnePrager()
else:
    model = load_model(snakemake.input.model)
properties = Properties(**params.properties)

# A killed run goes on from its checkpoint, unless a setting or the model has changed since.
weights = Path(snakemake.input.model).read_bytes() if snakemake.input.model else b""
state = hashlib.sha256(repr(sorted(params.items())).encode() + weights).hexdigest()[:16]
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
    checkpoint=checkpoints / f"{case}-{state}",
    progress=progress(case, "steps"),
)
print(f"{done['steps']} steps in {done['seconds']:.1f} s, {done['steps_per_second']:.3g} a second")
