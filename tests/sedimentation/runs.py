"""Small runs that the tests of sedimentation share."""

from pathlib import Path

import xarray as xr

from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.sedimentation import (
    Checkpoint,
    NearestNeighbours,
    Output,
    Properties,
    Schedule,
    random_start,
    settle,
    start_from,
)

DUST = Properties()


def run(
    folder,
    model=ROTNE_PRAGER,
    closure=None,
    particles=100,
    volume_fraction=1e-3,
    seed=1,
    start="rest",
    positions=None,
    velocities=None,
    step=0.1,
    duration=2.0,
    save_interval=0.5,
    properties=DUST,
    precision="float64",
    name="case",
    threads=1,
    checkpoint=None,
    checkpoint_interval=60.0,
    progress=None,
):
    """Let a few particles settle; return trajectory and series as xarray datasets."""
    folder = Path(folder)
    if positions is None:
        state = random_start(particles, volume_fraction, seed, velocity=start)
    else:
        given = start if velocities is None else velocities
        state = start_from(positions, volume_fraction, given)
    trajectory, series = folder / f"{name}.nc", folder / f"{name}.series.nc"
    settle(
        closure or NearestNeighbours(model, threads=threads),
        state,
        properties,
        Schedule(step, duration, save_interval),
        Output(trajectory, series, precision, seed, attributes={"seed": seed}),
        checkpoint and Checkpoint(checkpoint, checkpoint_interval),
        progress,
    )
    return xr.load_dataset(trajectory), xr.load_dataset(series)
