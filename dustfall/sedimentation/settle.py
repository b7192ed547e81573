"""A run that lasts: frames and series on disk, checkpoints, signals. Its physics is in `state`."""

import hashlib
import os
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from dustfall import __version__
from dustfall.columns import Column
from dustfall.files import remove_leftovers
from dustfall.sedimentation import checkpoint as checkpoints
from dustfall.sedimentation.neighbours import FARTHEST
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.state import Closure, Drag, State, check_closure, move
from dustfall.sedimentation.trajectory import (
    SERIES,
    TRACKED,
    Records,
    frame_type,
    series_type,
    write_series,
    write_trajectory,
)
from dustfall.spheres import plain
from dustfall.streams import Purpose, stream

UNITS = (
    "fluid_density, particle_density: kg m^-3; viscosity: Pa s; diameter: m; gravity: m s^-2; "
    "response_time (tau): s; settling_velocity (v_s): m s^-1; cell_length: d_p; "
    "step, duration, save_interval: tau; galileo, stokes_number (v_s tau / d_p): 1"
)

FRAMES, ROWS = "frames.bin", "series.bin"
"""Names of the records in the folder of a checkpoint."""

MOST_STEPS = 10**9
"""More steps than any run takes: a million particles take a second for each."""


@dataclass(frozen=True)
class Schedule:
    """When a run ends, and when it is written down; all in tau.

    Raises ValueError for a step that is not positive, times that are no multiples of it, or of more
    than MOST_STEPS, and a duration that is no multiple of `save_interval`: the last frame is the
    end.
    """

    step: float
    duration: float
    save_interval: float

    def __post_init__(self):
        for own in fields(self):
            object.__setattr__(self, own.name, plain(getattr(self, own.name)))
        if not (np.isfinite(self.step) and self.step > 0):
            raise ValueError(f"step is {self.step}: it has to be positive and finite, in tau")
        for name in ("duration", "save_interval"):
            value = getattr(self, name)
            count = round(value / self.step) if value / self.step <= MOST_STEPS else 0
            if count < 1 or abs(value - count * self.step) > 1e-9 * value:
                raise ValueError(
                    f"{name} is {value}: it has to be a multiple of the step, {self.step}, and of "
                    f"at most {MOST_STEPS} steps"
                )
        if self.steps % self.save_every:
            before = self.steps // self.save_every * self.save_interval
            allowed = [f"{time:.12g}" for time in (before, before + self.save_interval) if time > 0]
            raise ValueError(
                f"duration is {self.duration}: it has to be a multiple of save_interval, "
                f"{self.save_interval}, for the last frame to be the end; allowed next to it "
                f"{'are' if before else 'is'} {' and '.join(allowed)}"
            )

    @property
    def steps(self) -> int:
        """Steps from the start to the end."""
        return round(self.duration / self.step)

    @property
    def save_every(self) -> int:
        """Steps from one frame to the next."""
        return round(self.save_interval / self.step)


@dataclass(frozen=True)
class Output:
    """What a run leaves behind.

    trajectory, series: NetCDF files, see `write_trajectory` and `write_series`. precision: of the
    coordinates, "float32" or "float64". seed, case: choose the particles that the series follows.
    attributes: written into both files beside the settings of the run.

    Raises ValueError for another precision.
    """

    trajectory: Path
    series: Path
    precision: str = "float32"
    seed: int = 1
    case: int = 0
    attributes: Mapping[str, str | int | float] = field(default_factory=dict)

    def __post_init__(self):
        if self.precision not in ("float32", "float64"):
            raise ValueError(f"precision is {self.precision!r}: allowed are float32, float64")

    def tracked(self, particles: int) -> np.ndarray:
        """Rows (3,) of the particles that the series follows. Raises ValueError for too few."""
        if particles < TRACKED:
            raise ValueError(f"{particles} particles: at least {TRACKED} are needed, to be tracked")
        draws = stream(Purpose.TRACKED, self.seed, self.case)
        return draws.choice(particles, TRACKED, replace=False)


@dataclass(frozen=True)
class Checkpoint:
    """Where the state of an unfinished run is kept, and the wall time between two of them [s].

    A run that was killed goes on from there when it is called again, and ends with the same bits;
    at the end the folder is removed. SIGTERM and Ctrl-C save the state and stop.
    """

    folder: Path
    interval: float = 60.0


def settle(
    closure: Closure,
    start: State,
    properties: Properties,
    schedule: Schedule,
    output: Output,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, float]:
    """Let particles settle in a fluid at rest and write their trajectory and series.

    Where spheres overlap in the course of a run they move on as the closure says.

    Parameters
    ----------
    closure : tells the drag on all particles, at each step
    start : as from `random_start` or `start_from`; of a state that has moved already, places and
        velocities count: the run begins anew from them, at time zero
    properties : in SI; the motion depends on them through v_s tau / d_p alone
    schedule, output, checkpoint : when, what and where to write
    progress : called with the number of steps done and of all steps

    Returns
    -------
    `steps`, `seconds` and `steps_per_second` of this call

    Raises
    ------
    ValueError : the checkpoint is of a run with other settings, or another run is at work on it;
        the closure is made for another step, other properties or another volume fraction; or the
        flow is no Stokes flow (see `Properties.check_stokes_flow`).
    FloatingPointError : the drag is not finite, or a particle has flown off.
    SystemExit : SIGTERM or Ctrl-C came, and the state was saved.
    """
    check_closure(
        closure,
        schedule.step,
        properties.stokes_number,
        start.volume_fraction,
        None if closure.viscosity is None else properties.stokes_number / properties.galileo,
    )
    properties.check_stokes_flow()
    tracked = output.tracked(len(start.position))
    settings = {
        "dustfall_version": __version__,
        **closure.settings(),
        "n": len(start.position),
        "volume_fraction": start.volume_fraction,
        **asdict(schedule),
        "start_digest": _digest(start.position, start.velocity),
        "tracked": tracked.tolist(),
        "precision": output.precision,
        **asdict(properties),
    }
    columns = {**SERIES, **closure.series}
    with _working_folder(checkpoint, output) as folder, _terminated() as terminated:
        frame = frame_type(len(start.position), output.precision)
        state, frames, rows = _resume(folder, settings, closure, frame, series_type(columns))
        state = state or replace(start, steps=0, last_drag=None)
        first, began = state.steps, time.monotonic()
        saved = began
        while True:
            drag = closure(state)
            now = state.steps * schedule.step
            rows.append(time=now, **_measured(state, drag, tracked, closure))
            if state.steps % schedule.save_every == 0:
                frames.append(
                    time=now,
                    coordinates=state.position,
                    velocities=state.velocity,
                    drag_coefficient=drag.coefficient(state.velocity),
                )
            if progress is not None:
                progress(state.steps, schedule.steps)
            if state.steps == schedule.steps:
                break
            state = move(state, drag, schedule.step, properties.stokes_number)
            _check_places(state)
            stop = terminated()
            if checkpoint is not None and (stop or time.monotonic() - saved >= checkpoint.interval):
                _save(folder, settings, state, closure, frames, rows)
                saved = time.monotonic()
            if stop:
                kept = f"state saved in {folder}" if checkpoint is not None else "nothing saved"
                raise SystemExit(f"terminated after step {state.steps} of {schedule.steps}, {kept}")
        seconds = time.monotonic() - began
        attributes = _attributes(settings, start, properties, output)
        _finish(output, frames, rows, columns, tracked, start.box_length, attributes)
        # States first: a state whose records are gone could not be resumed.
        checkpoints.clear(folder)
        frames.remove()
        rows.remove()
    steps = state.steps - first
    return {"steps": steps, "seconds": seconds, "steps_per_second": steps / seconds}


def is_whole(output: Output, checkpoint: Checkpoint) -> bool:
    """Whether a run has come to its end: both files are there, and no state to go on from.

    What it left in the checkpoint's folder, where it was killed while it cleared up, is removed.

    Raises ValueError where another run is at work there.
    """
    folder = Path(checkpoint.folder)
    if not (Path(output.trajectory).exists() and Path(output.series).exists()):
        return False
    if folder.exists():
        with _alone_in(folder):
            if checkpoints.any_state(folder):
                return False
            checkpoints.clear(folder)
            for name in (FRAMES, ROWS):
                (folder / name).unlink(missing_ok=True)
        _remove(folder)
    return True


def _remove(folder: Path) -> None:
    """Remove the folder of a checkpoint, unless someone else's file is in there."""
    with suppress(OSError):
        folder.rmdir()


def _check_places(state: State) -> None:
    """Raise FloatingPointError where a particle has flown off, or is nowhere."""
    there = np.abs(state.position) <= FARTHEST * state.box_length
    if not there.all():
        row = np.flatnonzero(~there.all(axis=1))[0]
        raise FloatingPointError(
            f"particle {row} is at {state.position[row]} d_p after step {state.steps}: the time "
            "step or the start does not suit the drag"
        )


def _measured(state: State, drag: Drag, tracked: np.ndarray, closure: Closure) -> dict:
    """The columns of the series at this moment, but for the time."""
    falling, force = -state.velocity[:, 2], drag.on(state.velocity)
    return {
        "settling_velocity_mean": falling.mean(),
        "settling_velocity_variance": falling.var(),
        "drag_mean": force[:, 2].mean(),
        "tracked_position": state.position[tracked],
        "tracked_velocity": state.velocity[tracked],
        "tracked_force": force[tracked],
        **closure.statistics(state, drag),
    }


def _attributes(settings, start, properties, output) -> dict:
    return {
        **settings,
        **output.attributes,
        "cell_length": start.box_length,
        "galileo": properties.galileo,
        "stokes_number": properties.stokes_number,
        "response_time": properties.response_time,
        "settling_velocity": properties.settling_velocity,
        "units": UNITS,
    }


def _finish(output, frames, rows, columns: Mapping[str, Column], tracked, box_length, attributes):
    for file in (output.trajectory, output.series):
        remove_leftovers(file)
    write_trajectory(output.trajectory, frames, box_length, attributes)
    write_series(output.series, rows, columns, tracked, attributes)


def _digest(*arrays: np.ndarray) -> str:
    return hashlib.sha256(b"".join(a.tobytes() for a in arrays)).hexdigest()[:16]


def _save(folder: Path, settings, state: State, closure: Closure, frames: Records, rows: Records):
    frames.sync()
    rows.sync()
    memory = {f"closure.{name}": array for name, array in closure.memory().items()}
    drag = state.last_drag
    assert drag is not None, "a state is saved after a step"
    checkpoints.save(
        folder,
        settings,
        {
            "steps": state.steps,
            "position": state.position,
            "velocity": state.velocity,
            "beta": drag.beta,
            "force": drag.force,
            "whole_step": drag.whole_step,
            "frames": frames.count,
            "frames_digest": frames.digest(),
            "rows": rows.count,
            "rows_digest": rows.digest(),
            **memory,
        },
    )


def _resume(folder: Path, settings: dict, closure: Closure, frame: np.dtype, row: np.dtype):
    """The state to go on from, if any, and the records that belong to it, cut back to it."""
    for saved in checkpoints.load(folder, settings):
        # Records damaged, cut or lost leave the state before it, or a start anew.
        with suppress(ValueError, FileNotFoundError):
            frames, rows = (
                Records(folder / file, record, int(saved[name]), str(saved[f"{name}_digest"]))
                for name, file, record in (
                    ("frames", FRAMES, frame),
                    ("rows", ROWS, row),
                )
            )
            break
    else:
        closure.remember({})
        return None, Records(folder / FRAMES, frame), Records(folder / ROWS, row)
    closure.remember(
        {
            name.removeprefix("closure."): array
            for name, array in saved.items()
            if name.startswith("closure.")
        }
    )
    drag = Drag(saved["beta"], saved["force"], bool(saved["whole_step"]))
    fraction, steps = settings["volume_fraction"], int(saved["steps"])
    state = State(saved["position"], saved["velocity"], fraction, steps, drag)
    return state, frames, rows


@contextmanager
def _working_folder(checkpoint: Checkpoint | None, output: Output) -> Iterator[Path]:
    """The checkpoint's folder, removed after a whole run; without one, a temporary folder."""
    if checkpoint is None:
        parent = Path(output.trajectory).parent
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=parent, prefix=".settle.") as temporary:
            yield Path(temporary)
    else:
        folder = Path(checkpoint.folder)
        folder.mkdir(parents=True, exist_ok=True)
        with _alone_in(folder):
            yield folder
        _remove(folder)


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Keep other runs out of a folder for as long as this process lives, however it ends.

    Raises ValueError where another one is at work there. Not every system has such locks.
    """
    try:
        import fcntl
    except ModuleNotFoundError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(f"another run is at work in {folder}: let it end first") from None
        except OSError:
            pass
        yield
    finally:
        os.close(handle)


@contextmanager
def _terminated() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether SIGTERM or Ctrl-C has come, in place of ending there."""
    came = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield came.is_set  # signals reach the main thread only
        return
    before = {
        number: signal.signal(number, lambda *_: came.set())
        for number in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        yield came.is_set
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
