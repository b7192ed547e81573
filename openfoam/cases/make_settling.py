"""Make an OpenFOAM case: spheres of the paper's table settle in a periodic cube of fluid at rest.

    python -m openfoam.cases.make_settling CASE [--particles 1000] [--phi 1e-3] ...

Everything that does not depend on the options is in `settling/`; this writes the rest: `settings`,
the force model, and the parcels at the start, where a run of dustfall with the same seed has them.
Then `CASE/Allrun` settles them on one rank, `CASE/Allrun 2` on two.
"""

import argparse
import shutil
from pathlib import Path

import numpy as np

from dustfall.forces import FORMULAS, load_model
from dustfall.forces.export import export_openfoam
from dustfall.sedimentation import Properties, State, random_start
from dustfall.sedimentation.start import START_VELOCITY

TEMPLATE = Path(__file__).parent / "settling"
PLUGIN = Path(__file__).parents[1] / "build" / "libneighbourDrag.so"

CLOUD = "kinematicCloud"
"""What the solver calls its parcels."""

PARCELS_A_CELL = 8
"""Cells of the mesh only carry fluid at rest: as few as keep a parcel's way through them short."""

EMPTY_RECORDS = {
    "collisionRecordsPairAccessed": "labelField",
    "collisionRecordsPairOrigProcOfOther": "labelField",
    "collisionRecordsPairOrigIdOfOther": "labelField",
    "collisionRecordsPairData": "vectorField",
    "collisionRecordsWallAccessed": "labelField",
    "collisionRecordsWallPRel": "vectorField",
    "collisionRecordsWallData": "vectorField",
}
"""Fields of lists that the solver's parcels have for collisions, of which there are none."""


def make_case(
    case: Path,
    start: State,
    step: float,
    duration: float,
    save_every: int = 1,
    model=None,
    processors: int = 2,
    properties: Properties | None = None,
) -> None:
    """Write a case into the folder `case`.

    Parameters
    ----------
    case : folder to write, new or empty
    start : particles at the start
    step, duration : in tau; save_every : steps between frames
    model : force model; by default the one that ships
    processors : that the case can be decomposed for
    properties : of fluid and spheres; by default those of the paper

    Raises
    ------
    FileExistsError : the folder holds something already.
    """
    case = Path(case)
    if case.exists() and any(case.iterdir()):
        raise FileExistsError(f"{case} is not empty")
    properties = properties or Properties()
    cells = max(2, round((len(start.position) / PARCELS_A_CELL) ** (1 / 3)))

    shutil.copytree(TEMPLATE, case, dirs_exist_ok=True)
    export_openfoam(model or load_model(), case / "constant" / "forceModel")
    settings = {
        "side": start.box_length * properties.diameter,
        "cells": cells,
        "particleDensity": properties.particle_density,
        "fluidDensity": properties.fluid_density,
        "kinematicViscosity": properties.viscosity / properties.fluid_density,
        "gravity": -properties.gravity,
        "step": step * properties.response_time,
        "duration": duration * properties.response_time,
        "saveEvery": save_every,
        "processors": processors,
        # wmake puts it where OpenFOAM looks by itself.
        "plugin": f'"{PLUGIN.resolve() if PLUGIN.exists() else PLUGIN.name}"',
    }
    (case / "settings").write_text("".join(f"{key} {value};\n" for key, value in settings.items()))
    _write_parcels(case, start, cells, properties)


def _write_parcels(case, start, cells, properties):
    folder = case / "0" / "lagrangian" / CLOUD
    folder.mkdir(parents=True)
    number, side = len(start.position), start.box_length
    wrapped = start.position - side * np.floor(start.position / side)
    along = np.clip((wrapped / side * cells).astype(int), 0, cells - 1)
    # blockMesh numbers the cells of a block with x running fastest.
    cell = (along[:, 2] * cells + along[:, 1]) * cells + along[:, 0]
    places = (wrapped * properties.diameter).tolist()
    lines = [f"({x!r} {y!r} {z!r}) {c}" for (x, y, z), c in zip(places, cell, strict=True)]
    _write(folder, "positions", "Cloud<basicKinematicCollidingParcel>", _list(lines))
    velocities = (start.velocity * properties.settling_velocity).tolist()
    speeds = [f"({x!r} {y!r} {z!r})" for x, y, z in velocities]
    _write(folder, "U", "vectorField", _list(speeds))
    _write(folder, "origId", "labelField", _list(map(str, range(number))))
    for name in ("f", "angularMomentum", "torque", "UTurb"):
        _write(folder, name, "vectorField", f"{number}{{(0 0 0)}}")
    labels = {"active": 1, "typeId": -1, "origProcId": 0}
    scalars = {
        "nParticle": 1,
        "d": properties.diameter,
        "dTarget": properties.diameter,
        "rho": properties.particle_density,
        "age": 0,
        "tTurb": 0,
    }
    for name, value in labels.items():
        _write(folder, name, "labelField", f"{number}{{{value}}}")
    for name, value in scalars.items():
        _write(folder, name, "scalarField", f"{number}{{{value!r}}}")
    for name, kind in EMPTY_RECORDS.items():
        _write(folder, name, f"{kind}CompactField", f"{number + 1}{{0}}\n0()")

    uniform = case / "0" / "uniform" / "lagrangian" / CLOUD
    uniform.mkdir(parents=True)
    counts = f"processor0 {{ particleCount {number}; }}"
    _write(uniform, "cloudProperties", "dictionary", f"geometry positions;\n{counts}")


def _list(items):
    items = list(items)
    return "\n".join([str(len(items)), "(", *items, ")"])


def _write(folder, name, kind, content):
    head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {name}; }}\n"
    (folder / name).write_text(f"{head}{content}\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("case", type=Path, help="folder to write, new or empty")
    parser.add_argument("--particles", type=int, default=1000)
    parser.add_argument("--phi", type=float, default=1e-3, help="volume fraction")
    parser.add_argument("--step", type=float, default=0.1, help="tau")
    parser.add_argument("--duration", type=float, default=60.0, help="tau")
    parser.add_argument("--save-every", type=int, default=10, help="steps between frames")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", choices=START_VELOCITY, default="stokes")
    parser.add_argument("--model", help="force model: a .safetensors file or a closed formula")
    parser.add_argument("--processors", type=int, default=2)
    given = parser.parse_args()
    make_case(
        given.case,
        random_start(given.particles, given.phi, given.seed, velocity=given.start),
        given.step,
        given.duration,
        given.save_every,
        FORMULAS.get(given.model) or load_model(given.model),
        given.processors,
    )
