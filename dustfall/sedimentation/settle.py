"""A run: particles settle in a periodic cube under the force of a model."""

import hashlib
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np

from dustfall import __version__
from dustfall.files import remove_leftovers
from dustfall.sedimentation import checkpoint as checkpoints
from dustfall.sedimentation.blocks import Blocks
from dustfall.sedimentation.dynamics import advance, drag_coefficients
from dustfall.sedimentation.neighbour_list import NeighbourList
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.start import cube_side, random_positions
from dustfall.sedimentation.statistics import step_statistics
from dustfall.sedimentation.trajectory import (
    SERIES,
    TRACKED,
    Records,
    frame_type,
    write_series,
    write_trajectory,
)

START_VELOCITY = {"rest": 0.0, "stokes": -1.0}
"""Vertical velocity at the start, in v_s."""

POSITIONS, TRACKED_PARTICLES, PROBES = range(3)
"""Items of the random streams."""

UNITS = (
    "fluid_density, particle_density: kg m^-3; viscosity: Pa s; diameter: m; gravity: m s^-2; "
    "response_time (tau): s; settling_velocity (v_s): m s^-1; cell_length: d_p; "
    "step, duration, save_interval: tau; galileo, stokes_number (v_s tau / d_p): 1"
)


def settle(
    model,
    properties: Properties,
    particles: int,
    volume_fraction: float,
    step: float,
    duration: float,
    save_interval: float,
    seed: int,
    trajectory: str | Path,
    series: str | Path,
    start: str = "rest",
    positions: np.ndarray | None = None,
    velocities: np.ndarray | None = None,
    precision: str = "float32",
    checkpoint: str | Path | None = None,
    checkpoint_interval: float = 60.0,
    threads: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> dict:
    """Let particles settle in a fluid at rest and write their trajectory and series.

    A step finds the five nearest neighbours of each particle, asks the model for its drag in the
    frame of the flow that it meets, and moves it exactly as for a constant drag coefficient. The
    coefficient is that of the middle of the step, extrapolated from this step and the one before:
    second order as long as the neighbours stay the same, with one call of the model a step.

    Where spheres overlap in the course of a run they move on as the model says (a neighbour closer
    than contact is held at contact by the force models). At each step `overlaps` counts such
    pairs, and `below_contact` the neighbours that the model was shown closer than contact.

    Parameters
    ----------
    model : has `predict(neighbours)`, (n, 5, 3) in d_p to (n, 3) in Re_p c_D, flow along +y
    properties : in SI; the motion depends on them through v_s tau / d_p alone
    particles, volume_fraction : set the side of the cube, (n V_p / phi)^(1/3)
    step, duration, save_interval : in tau; the latter two are multiples of `step`
    seed : of the start positions and of the choice of the tracked particles
    trajectory, series : NetCDF files to write, see `write_trajectory` and `write_series`
    start : "rest", or "stokes" for v_s downwards; does not matter where `velocities` are given
    positions : (n, 3) at the start in d_p; by default random without overlap
    velocities : (n, 3) at the start in v_s; by default as `start` says
    precision : of the coordinates in the trajectory, "float32" or "float64"
    checkpoint : folder for the state of an unfinished run. A run that was killed goes on from there
        when it is called again, and ends with the same bits; at the end the folder is removed.
        SIGTERM saves the state and stops.
    checkpoint_interval : wall time between checkpoints, s
    threads : that share the work of a step; their number changes no bit of the results
    progress : called with the number of steps done and of all steps

    Returns
    -------
    `steps`, `seconds` and `steps_per_second` of this call

    Raises
    ------
    ValueError : a setting is out of range, or the checkpoint is of a run with other settings.
    FloatingPointError : the model returned a force that is not finite.
    SystemExit : SIGTERM came, and the state was saved.
    """
    trajectory, series = Path(trajectory), Path(series)
    side = cube_side(particles, volume_fraction)
    steps = _multiple("duration", duration, step)
    save_every = _multiple("save_interval", save_interval, step)
    if start not in START_VELOCITY:
        raise ValueError(f"start is {start!r}: allowed are {', '.join(START_VELOCITY)}")
    if precision not in ("float32", "float64"):
        raise ValueError(f"precision is {precision!r}: allowed are float32, float64")
    if positions is None:
        rng = np.random.default_rng([seed, POSITIONS])
        positions = random_positions(rng, particles, volume_fraction)
    if velocities is None:
        velocities = np.tile([0.0, 0.0, START_VELOCITY[start]], (particles, 1))
    positions, velocities = (np.array(a, dtype=np.float64) for a in (positions, velocities))
    for name, array in {"positions": positions, "velocities": velocities}.items():
        if array.shape != (particles, 3):
            raise ValueError(f"{name} have shape {array.shape}: ({particles}, 3) is needed")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} at the start hold a value that is not finite")
    rng = np.random.default_rng([seed, TRACKED_PARTICLES])
    tracked = rng.choice(particles, TRACKED, replace=False)
    stokes_number = properties.stokes_number

    settings = {
        "dustfall_version": __version__,
        "model": getattr(model, "name", type(model).__name__),
        "model_digest": _model_digest(model),
        "n": particles,
        "volume_fraction": volume_fraction,
        "step": step,
        "duration": duration,
        "save_interval": save_interval,
        "seed": seed,
        "start": start,
        "start_digest": _digest(np.stack([positions, velocities])),
        "precision": precision,
        **asdict(properties),
    }
    attributes = {
        **settings,
        "cell_length": side,
        "galileo": properties.galileo,
        "stokes_number": stokes_number,
        "response_time": properties.response_time,
        "settling_velocity": properties.settling_velocity,
        "units": UNITS,
    }
    with (
        _working_folder(checkpoint, trajectory) as folder,
        _terminated() as terminated,
        Blocks(particles, threads) as blocks,
    ):
        state, frames, rows = _resume(folder, settings, frame_type(particles, precision))
        if state:
            done, position, velocity = int(state["done"]), state["position"], state["velocity"]
            beta_before, side_force_before = state["beta"], state["side_force"]
            index_before, order = state["index"], state.get("order")
        else:
            done, position, velocity, order = 0, positions, velocities, None
        first, began = done, time.monotonic()
        saved = began
        neighbours = NeighbourList(particles, side, blocks, order, updates=done)
        while True:
            index = neighbours.update(position)
            beta, side_force = _drag(model, velocity, neighbours, blocks)
            if done == 0:
                beta_before, side_force_before, index_before = beta, side_force, index

            rows.append(
                time=done * step,
                **step_statistics(velocity, beta, side_force, neighbours, index_before),
                tracked_position=position[tracked],
                tracked_velocity=velocity[tracked],
                tracked_force=side_force[tracked] - beta[tracked, None] * velocity[tracked],
            )
            if done % save_every == 0:
                frames.append(
                    time=done * step,
                    coordinates=position,
                    velocities=velocity,
                    drag_coefficient=beta,
                )
            if progress is not None:
                progress(done, steps)
            if done == steps:
                break

            position, velocity = advance(
                position,
                velocity,
                1.5 * beta - 0.5 * beta_before,
                1.5 * side_force - 0.5 * side_force_before,
                step,
                stokes_number,
            )
            beta_before, side_force_before, index_before = beta, side_force, index
            done += 1

            if checkpoint is not None and (
                terminated() or time.monotonic() - saved >= checkpoint_interval
            ):
                frames.sync()
                rows.sync()
                state = {
                    "done": done,
                    "position": position,
                    "velocity": velocity,
                    "beta": beta_before,
                    "side_force": side_force_before,
                    "index": index_before,
                    "order": neighbours.order,
                    "frames": frames.count,
                    "rows": rows.count,
                }
                checkpoints.save(folder, settings, state)
                saved = time.monotonic()
            if terminated():
                kept = f"state saved in {folder}" if checkpoint is not None else "nothing saved"
                raise SystemExit(f"terminated after step {done} of {steps}, {kept}")
        seconds = time.monotonic() - began

        for file in (trajectory, series):
            remove_leftovers(file)
        write_trajectory(trajectory, frames, side, attributes)
        write_series(series, rows, tracked, attributes)
        # States first: a state whose records are gone could not be resumed.
        checkpoints.clear(folder)
        frames.remove()
        rows.remove()
    return {
        "steps": done - first,
        "seconds": seconds,
        "steps_per_second": (done - first) / seconds,
    }


def _drag(model, velocity: np.ndarray, neighbours: NeighbourList, blocks: Blocks):
    """Drag coefficient (n,) and side force (n, 3) of all particles, block by block in space."""
    beta, side_force = np.empty(len(velocity)), np.empty_like(velocity)

    def work(first, last):
        rows = neighbours.order[first:last]
        beta[rows], side_force[rows] = drag_coefficients(
            model, velocity[rows], neighbours.vectors(rows), rows
        )

    blocks.run(work)
    return beta, side_force


def _multiple(name: str, value: float, step: float) -> int:
    """How many steps `value` is."""
    if not (np.isfinite(step) and step > 0):
        raise ValueError(f"step is {step}: it has to be positive and finite, in tau")
    count = round(value / step) if np.isfinite(value) else 0
    if count < 1 or abs(value - count * step) > 1e-9 * value:
        raise ValueError(f"{name} is {value}: it has to be a multiple of the step, {step}")
    return count


def _digest(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


def _model_digest(model) -> str:
    """Digest of a model's forces on fixed scenes: any two models that differ there differ here."""
    rng = np.random.default_rng([0, PROBES])
    direction = rng.normal(size=(64, 5, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    distance = 10 ** rng.uniform(0.1, 2.5, size=(64, 5, 1))
    return _digest(model.predict(distance * direction))


def _resume(folder: Path, settings: dict, frame: np.dtype):
    """The state to go on from, if any, and the records that belong to it, cut back to it."""
    for state in checkpoints.load(folder, settings):
        with suppress(ValueError):
            frames = Records(folder / "frames.bin", frame, int(state["frames"]))
            rows = Records(folder / "series.bin", SERIES, int(state["rows"]))
            return state, frames, rows
    return None, Records(folder / "frames.bin", frame), Records(folder / "series.bin", SERIES)


@contextmanager
def _working_folder(checkpoint: str | Path | None, trajectory: Path) -> Iterator[Path]:
    """The checkpoint's folder, removed after a whole run; without one, a temporary folder."""
    if checkpoint is None:
        trajectory.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=trajectory.parent, prefix=".settle.") as folder:
            yield Path(folder)
    else:
        folder = Path(checkpoint)
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
        with suppress(OSError):  # someone else's file in there stays
            folder.rmdir()


@contextmanager
def _terminated() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether SIGTERM has come, which would end the process at once."""
    came = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield came.is_set  # signals reach the main thread only
        return
    before = signal.signal(signal.SIGTERM, lambda *_: came.set())
    try:
        yield came.is_set
    finally:
        signal.signal(signal.SIGTERM, before)
