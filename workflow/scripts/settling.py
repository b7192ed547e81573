"""What all scripts share that let the particles of a case settle."""

import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path

from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import Checkpoint, Output, Schedule, settle
from dustfall.sedimentation.start import random_start, read_start, start_from
from dustfall.sedimentation.state import Closure
from workflow import stops
from workflow.checksums import CHECKPOINTS


def settle_case(snakemake, closure: Closure, properties: Properties, progress: Callable) -> None:
    """Let a case settle from its start, or go on where it was killed."""
    params, case = snakemake.params, Path(snakemake.output.trajectory).stem
    if snakemake.input.start:
        position, velocity = read_start(
            snakemake.input.start, params.particles, params.volume_fraction
        )
        start = start_from(
            position, params.volume_fraction, params.start if velocity is None else velocity
        )
    else:
        start = random_start(
            params.particles, params.volume_fraction, params.seed, params.stream, params.start
        )
    trajectory, series = map(Path, (snakemake.output.trajectory, snakemake.output.series))
    output = Output(
        trajectory,
        series,
        params.precision,
        params.seed,
        params.stream,
        {"seed": params.seed, "stream": params.stream, "start": params.start},
    )
    schedule = Schedule(**params.schedule)
    checkpoint = Checkpoint(_checkpoint(snakemake), snakemake.resources.checkpoint_interval)
    bar = progress(case, "steps")
    try:
        done = settle(closure, start, properties, schedule, output, checkpoint, bar)
    except SystemExit as stop:
        stops.note(f"{case}: {stop}")
        raise
    rate = done["steps_per_second"]
    print(f"{done['steps']} steps in {done['seconds']:.1f} s, {rate:.3g} a second")


def properties_of(params) -> Properties:
    """Properties of fluid and particles in SI, at the Galileo number of the case."""
    properties = Properties(**params.properties)
    return properties.with_galileo_multiple(params.galileo_multiple, params.change)


def _checkpoint(snakemake) -> Path:
    """Folder of the checkpoint; those of other settings or files are removed."""
    state = hashlib.sha256(repr(sorted(snakemake.params.items())).encode())
    for file in (snakemake.input.get("model"), snakemake.input.start):
        state.update(Path(file).read_bytes() if file else b"none")
    case = Path(snakemake.output.trajectory).stem
    folder = Path(snakemake.output.trajectory).parent / CHECKPOINTS
    for other in folder.glob(f"{case}-*"):
        if other.name != f"{case}-{state.hexdigest()[:16]}":
            shutil.rmtree(other)
    return folder / f"{case}-{state.hexdigest()[:16]}"
