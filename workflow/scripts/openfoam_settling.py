"""Let the same cloud settle in OpenFOAM and here, and draw 1/beta of both in time."""

import shutil
import subprocess
import tempfile
from pathlib import Path

import pandas as pd
from openfoam.cases.make_settling import PLUGIN, make_case
from openfoam.cases.read_settling import read_frames

import joblog
from dustfall.figures.openfoam import inverse_beta_in_time
from dustfall.figures.style import save
from dustfall.forces.learned import load_model
from dustfall.sedimentation import NearestNeighbours, Properties, State, random_start, step
from workflow.library import ROOT

FRAMES = 100  # of OpenFOAM's run: it writes them as text

progress = joblog.start(snakemake)
params = snakemake.params
if shutil.which("icoUncoupledKinematicParcelFoam") is None or not PLUGIN.exists():
    raise RuntimeError("OpenFOAM or the plugin is missing here; `make openfoam` sets both up")
built = PLUGIN.stat().st_mtime
newer = [file for file in params.sources if (ROOT / file).stat().st_mtime > built]
if newer:
    raise RuntimeError(f"{newer[0]} is newer than the plugin; `make openfoam` builds it anew")

properties, model = Properties(**params.properties), load_model()
start = random_start(params.particles, params.volume_fraction, params.seed, params.stream, "stokes")
steps = round(params.duration / params.step)
every = max(1, steps // FRAMES)


def row(program: str, time: float, position, velocity) -> dict:
    """Means over the particles of 1/beta and of the velocity, downwards, over that of Stokes."""
    state = State(position, velocity, params.volume_fraction)
    beta = NearestNeighbours(model)(state).beta
    return {
        "program": program,
        "time": time,
        "inverse_beta": (1 / beta).mean(),
        "velocity": -velocity[:, 2].mean(),
    }


rows = [row("dustfall", 0.0, start.position, start.velocity)]
state, closure, report = start, NearestNeighbours(model), progress("dustfall", "steps")
for number in range(1, steps + 1):
    state = step(state, closure, params.step, properties.stokes_number)
    if number % every == 0:
        rows.append(row("dustfall", number * params.step, state.position, state.velocity))
    report(number, steps)

rows.append({**rows[0], "program": "OpenFOAM"})
with tempfile.TemporaryDirectory() as folder:
    case = Path(folder, "case")
    make_case(case, start, params.step, params.duration, every, model, properties=properties)
    subprocess.run([case / "Allrun"], check=True)
    for frame in read_frames(case, properties):
        time = frame.time / properties.response_time
        rows.append(row("OpenFOAM", time, frame.position, frame.velocity))

table = pd.DataFrame(rows)
print(table.groupby("program").describe().to_string())
save(inverse_beta_in_time(table), table, Path(snakemake.output.png).with_suffix(""))
