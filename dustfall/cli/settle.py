"""`dustfall settle`: a cloud that settles in a periodic cube, and goes on when it was killed."""

import sys
from pathlib import Path

from dustfall.cli import models

SUMMARY = "let particles settle in a periodic cube of fluid at rest"

DESCRIPTION = """\
A run that was killed goes on where it was when the same command is called again, and ends with
the same bits; Ctrl-C and SIGTERM save the state and stop. Besides the trajectory run.nc there is
run.series.nc, with means over the particles at every step.
Starts: a trajectory .nc, or a table x, y, z [d_p], velocity_x, velocity_y, velocity_z [v_s] (the
velocities may be left out); v_s is the settling velocity of an isolated particle, z upwards."""

EXAMPLES = """\
  dustfall settle --particles 1000 --phi 1e-3 -o run.nc
  dustfall settle --particles 10000 --phi 1e-3 --closure all_particles --threads 2 -o run.nc
  dustfall settle start.csv --phi 1e-4 --model rotne_prager --duration 20 -o run.nc"""

PROPERTIES = {
    "fluid_density": "kg/m3",
    "viscosity": "Pa s",
    "diameter": "m",
    "particle_density": "kg/m3",
    "gravity": "m/s2",
}


def add_arguments(parser) -> None:
    """Declare the arguments."""
    parser.add_argument("start", nargs="?", help="where the particles start; else at random")
    parser.add_argument("--particles", type=int, help="number of particles of a random start")
    parser.add_argument("--phi", type=float, required=True, help="volume fraction")
    parser.add_argument("-o", "--output", required=True, help="trajectory to write, .nc")
    parser.add_argument(
        "--closure", default="nearest_neighbours", choices=("nearest_neighbours", "all_particles"),
        help="what tells the drag: a force model of the nearest neighbours (default), or the "
        "hydrodynamics of all particles",
    )  # fmt: skip
    parser.add_argument("--model", help=f"of nearest_neighbours: {models.HELP}; default: anchored")
    parser.add_argument("--neighbours", type=int, help="of a closed formula; default: 5")
    parser.add_argument("--fluid", help="of all_particles: unsteady (default) or quasi_steady")
    for name, default, text in (
        ("step", 0.1, "time step [tau]"),
        ("duration", 100.0, "time at the end [tau], a multiple of --save-every"),
        ("save-every", 1.0, "time between frames [tau]"),
        ("checkpoint-interval", 60.0, "wall time between checkpoints [s]"),
    ):
        parser.add_argument(
            f"--{name}", type=float, default=default, help=f"{text}; default: {default:g}"
        )
    parser.add_argument("--seed", type=int, default=1, help="of a random start; default: 1")
    parser.add_argument(
        "--velocity", default="rest", choices=("rest", "stokes"),
        help="at the start, where none is given: at rest (default) or at the Stokes velocity",
    )  # fmt: skip
    parser.add_argument(
        "--precision", default="float32", choices=("float32", "float64"), help="of coordinates"
    )
    parser.add_argument("--threads", type=int, default=1, help="they change no bit; default: 1")
    dust = parser.add_argument_group("properties", "by default those of mineral dust in air")
    for name, unit in PROPERTIES.items():
        dust.add_argument(f"--{name.replace('_', '-')}", type=float, help=f"[{unit}]")


def run(options) -> None:
    """Settle, or go on.

    Raises ValueError for arguments that do not fit together, FileExistsError for a run that is
    whole.
    """
    trajectory = Path(options.output)
    if trajectory.suffix != ".nc":
        raise ValueError(f"{trajectory}: a trajectory has the suffix .nc")
    folder = trajectory.with_suffix(".checkpoint")
    whole = FileExistsError(f"{trajectory} is there, and whole: remove it to run anew")
    if trajectory.exists() and not folder.exists():
        raise whole
    from dustfall.progress import Progress
    from dustfall.sedimentation import Checkpoint, Output, Properties, Schedule, settle
    from dustfall.sedimentation.settle import is_whole

    given = {name: getattr(options, name) for name in PROPERTIES}
    properties = Properties(**{name: value for name, value in given.items() if value is not None})
    schedule = Schedule(options.step, options.duration, options.save_every)
    attributes = {"seed": options.seed, "start": options.start or "random"}
    series = trajectory.with_suffix(".series.nc")
    output = Output(trajectory, series, options.precision, options.seed, attributes=attributes)
    checkpoint = Checkpoint(folder, options.checkpoint_interval)
    # One that was killed while it cleared up has left the folder.
    if is_whole(output, checkpoint):
        raise whole
    with Progress(f"settle {trajectory.name}", "steps") as progress:
        done = settle(
            _closure(options, properties),
            _start(options),
            properties,
            schedule,
            output,
            checkpoint,
            progress.report,
        )
    print(
        f"{trajectory}, {series}: {done['steps']} steps in {done['seconds']:.1f} s", file=sys.stderr
    )


def _closure(options, properties):
    from dustfall.sedimentation import AllParticles, NearestNeighbours

    if options.closure == "all_particles":
        for name in ("model", "neighbours"):
            if getattr(options, name) is not None:
                raise ValueError(f"--{name} is of nearest_neighbours; all_particles has none")
        return AllParticles(
            properties, options.step, options.fluid or "unsteady", threads=options.threads
        )
    if options.fluid is not None:
        raise ValueError("--fluid is of all_particles; nearest_neighbours has none")
    model = models.named_model(options.model or "anchored")
    return NearestNeighbours(model, options.neighbours, options.threads)


def _start(options):
    from dustfall.sedimentation import random_start, start_from
    from dustfall.sedimentation.start import read_start

    if (options.start is None) == (options.particles is None):
        raise ValueError("a file to start from, or --particles for a random start: one is needed")
    if options.start is None:
        return random_start(options.particles, options.phi, options.seed, velocity=options.velocity)
    position, velocity = read_start(options.start, None, options.phi)
    return start_from(position, options.phi, options.velocity if velocity is None else velocity)
