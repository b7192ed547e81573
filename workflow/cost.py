"""What a campaign is about to take, and whether this machine holds it.

Rates are those of the campaign of docs/validation.md (an AMD EPYC, run times by stage) and of
single runs, rounded up; they foretell a campaign from its configuration alone, before anything is
planned.
"""

import os
import shutil
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from dustfall.forces.features import KINDS
from dustfall.forces.learned import multiplications
from dustfall.own_data import shape
from workflow import plan
from workflow.checksums import RESULTS

JOB_SECONDS = 3.6
"""Start and imports of a job."""

OTHER_JOBS = 40
"""Tables and figures, of which every campaign has one each."""

SOLVE_SECONDS = {"multipole": 2e-3, "elements": 1.0, "paper": 10.0}
"""One scene of six spheres by each method; it grows with their square. Boundary elements need from
0.1 to some seconds."""

NETWORK_SECONDS = 5e-10
"""One multiplication by a weight, for one scene in one epoch, with its share of all else."""

STEP_SECONDS = {"neighbours": 2.5e-6, "all particles": 1.0e-5}
"""One particle in one step."""

CLOUD_SECONDS = 3e-10
"""A frozen cloud over the cube of the rows of its matrix, three a particle; 700 take 2e-10."""

SCENE_BYTES = 1500
"""A scene of five neighbours with its record of forces, its place in the data set and its
predictions."""

STEP_BYTES = 400
"""A step in the series of a run."""

VECTOR_BYTES = {"float32": 12, "float64": 24}

PLANNED_BYTES = 17_000
"""A job in the memory of Snakemake, which plans all of them."""

JOB_BYTES = 0.6e9
"""A job with its libraries."""

PARTICLE_BYTES = 1000
"""A particle in the memory of a run, with its lists."""

FRAME_BYTES = 32
"""A particle in a frame, where the spectra of all frames are in memory at once."""

MATRIX_BYTES = 40
"""An entry of the matrix that couples the particles of a frozen cloud, with its factors."""

WEIGHT_BYTES = 32
"""A weight in double precision with its gradient and both moments of AdamW."""

YEAR = 365.25 * 24 * 3600.0
"""Longest campaign that is begun without being told to [s of the clock]."""

GO_ON = "go_on"
"""Setting of the command line alone, `--config go_on=true`: begin what does not fit."""


class CostError(ValueError):
    """A campaign that this machine cannot hold; the message is for whoever asked for it."""


@dataclass(frozen=True)
class Cost:
    """What a campaign takes, about. seconds: of one core; disk, planning, memory: bytes.

    planning: memory that Snakemake takes. memory: that of the largest job.
    """

    jobs: int
    seconds: float
    disk: float
    planning: float
    memory: float

    def __str__(self) -> str:
        return (
            f"{self.jobs} jobs, {_round(self.seconds / 3600)} core-hours, "
            f"{_round(self.disk / 1e9)} GB of disk, {_round(self.memory / 1e9)} GB of memory for "
            "the largest job"
        )


def cost(config: dict) -> Cost:
    """Foretell what the whole campaign of a complete configuration takes, were nothing done yet."""
    stokes, settle, own = config["stokes"], config["sedimentation"], config["dataset"]["file"]
    # With data of one's own no scene is drawn or solved.
    numbers = {} if own else config["scenes"]["number"]
    drawn = sum(numbers.values())
    scenes = shape(own)[0] if own else drawn
    kept = sum(min(number, stokes["keep_meshes"]) for number in numbers.values())
    audited = min(drawn, stokes["audit"])
    shards = sum(ceil(number / config["scenes"]["shard_size"]) for number in numbers.values())
    frozen = config["figures"]["frozen_cloud"]
    rows = 3 * frozen["particles"]
    clouds = frozen["clouds"] * len(settle["volume_fractions"])
    trainings = list(_trainings(config))
    cases = plan.cases(config)
    pairs = ((plan.neighbours(config) + 1) / 6) ** 2
    seconds = pairs * drawn * SOLVE_SECONDS[stokes["method"]]
    seconds += pairs * (audited + kept) * SOLVE_SECONDS["elements"]
    # No method audits itself.
    by_paper = 0 if stokes["method"] == "paper" else min(drawn, stokes["audit_paper"])
    seconds += pairs * by_paper * SOLVE_SECONDS["paper"]
    seconds += sum(work * NETWORK_SECONDS for work, _ in trainings)
    seconds += clouds * rows**3 * CLOUD_SECONDS
    # Coordinates, velocities and drag; what is unfinished lies in the checkpoint as well.
    frame = VECTOR_BYTES[settle["precision"]] + 16
    disk, frames, memory = scenes * SCENE_BYTES, [], scenes * SCENE_BYTES
    for name, case in cases.items():
        times = plan.schedule(config, name)
        steps = times["duration"] / times["step"]
        kind = "all particles" if case.compared == plan.ALL_PARTICLES else "neighbours"
        seconds += case.particles * steps * STEP_SECONDS[kind]
        frames.append(case.particles * (times["duration"] / times["save_interval"] + 1))
        disk += steps * STEP_BYTES
        memory = max(memory, case.particles * PARTICLE_BYTES + frames[-1] * FRAME_BYTES)
    disk += frame * (sum(frames) + max(frames))
    memory = max(memory, rows**2 * MATRIX_BYTES)
    memory = max(memory, *(weights * WEIGHT_BYTES for _, weights in trainings))
    jobs = 2 * shards + kept + len(trainings) + 2 * len(cases) + OTHER_JOBS
    return Cost(jobs, seconds + jobs * JOB_SECONDS, disk, jobs * PLANNED_BYTES, memory + JOB_BYTES)


def check_plan(bound: Cost, go_on: bool) -> None:
    """Raise CostError where the plan or the files of a campaign do not fit this machine."""
    _require("memory to plan its jobs", bound.planning, _memory(), go_on)
    place = RESULTS if RESULTS.is_dir() else Path()
    room = shutil.disk_usage(place).free
    if bound.disk > room:
        # What is there already takes no more room.
        room += sum(path.stat().st_size for path in place.rglob("*") if path.is_file())
    _require("disk", bound.disk, room, go_on)


def check_jobs(bound: Cost, cores: int, device: str, go_on: bool) -> None:
    """Raise CostError where the jobs of a campaign do not fit this machine, or take too long."""
    if device == "cuda":
        import torch  # here alone, as it takes seconds

        if not torch.cuda.is_available():
            raise CostError("idnn.device is cuda, but PyTorch finds no GPU here: set it to cpu.")
    _require("memory for its largest job", bound.memory, _memory(), go_on)
    years = bound.seconds / max(cores, 1) / YEAR
    if years > 1 and not go_on:
        raise CostError(
            f"the campaign would take {_round(years)} years on {cores} cores: choose a smaller "
            f"one, or begin it all the same with --config {GO_ON}=true."
        )


def _require(what: str, needed: float, there: float, go_on: bool) -> None:
    if needed > there and not go_on:
        raise CostError(
            f"the campaign would take {_round(needed / 1e9)} GB of {what}, and this machine has "
            f"{_round(there / 1e9)} GB: choose a smaller one, or begin it all the same with "
            f"--config {GO_ON}=true."
        )


def _memory() -> float:
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))


def _trainings(config: dict):
    """Multiplications of every training of a network, over its epochs, and weights in memory."""
    idnn = config["idnn"]
    scenes, neighbours = plan.training_scenes(config, "idnn"), plan.neighbours(config)
    for layers in idnn["layers"]:
        for component in ("streamwise", "lateral"):
            each = multiplications("idnn", layers, component, neighbours)
            folds = idnn["folds"]
            yield each * scenes * folds * idnn["training"]["epochs"], each * folds
    trials = [
        trial.split("-", 1) for trial in (*plan.learning_curve(config), *plan.ablation(config))
    ]
    layers_of = {
        "idnn": max(idnn["layers"], key=lambda row: multiplications("idnn", row, "lateral"))
    }
    layers_of |= idnn["layers_of"]
    models = [(model, f"{layers_of[model]}-all") for model, kind in KINDS.items() if kind.final]
    for model, rest in (*trials, *models):
        layers, number = rest.rsplit("-", 1)
        drawn = plan.training_scenes(config, model) if number == "all" else int(number)
        each = sum(
            multiplications(model, plan.trial_layers(layers), component, neighbours)
            for component in ("streamwise", "lateral")
        )
        yield each * drawn * plan.training(config, model)["epochs"], each


def _round(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:,.0f}" if value < 1e6 else f"{value:.1e}"
