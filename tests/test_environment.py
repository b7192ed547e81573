"""Solving and prediction work where numpy, numba, scipy and safetensors are all there is."""

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]

PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "safetensors")
"""What a bare `pip install dustfall` brings; llvmlite comes with numba."""

OTHER_PACKAGES = ("freud", "gmsh", "h5py", "matplotlib", "netCDF4", "pandas", "torch", "xarray")

OTHER_ROOMS = ("dustfall.stokes.elements", "dustfall.training", "dustfall.analysis")


@pytest.fixture(scope="module")
def bare_environment(tmp_path_factory) -> Path:
    """A folder of links to the library and to its base packages, with their metadata."""
    folder = tmp_path_factory.mktemp("environment")
    (folder / "dustfall").symlink_to(ROOT / "dustfall")
    for name in PACKAGES:
        found = distribution(name)
        for top in {Path(file).parts[0] for file in found.files} - {".."}:
            (folder / top).symlink_to(found.locate_file(top))
    return folder


def run(folder: Path, code: str):
    """What `code` leaves in `result`, run with the standard library and `folder` alone."""
    code = f"import json, sys\nsys.path.append({str(folder)!r})\n{code}\nprint(json.dumps(result))"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_model_that_ships_predicts_in_a_bare_environment(bare_environment):
    code = """
from dustfall.forces import load_model
neighbours = [[[9.0 * (j + 1), 0.0, 0.0] for j in range(5)]]
result = load_model().predict(neighbours).tolist()"""
    (force,) = run(bare_environment, code)
    assert 0.0 < force[1] < 24.0


def test_the_solver_solves_in_a_bare_environment(bare_environment):
    code = """
from dustfall.stokes import forces_on_fixed_spheres
result = forces_on_fixed_spheres([[0.0, 0.0, 0.0], [0.0, 1.5, 0.0]]).tolist()"""
    forces = np.array(run(bare_environment, code))
    np.testing.assert_allclose(forces[0], forces[1], atol=24.0 * 1e-4)


ROOMS = {
    "analysis": "analysis",
    "benchmarks.solver": "mesh",
    "sedimentation": "files",
    "stokes.elements.mesh": "mesh",
    "training": "train",
}
"""Rooms that need more, and the extra that brings the first package that they miss."""


def test_a_missing_package_is_named_with_the_extra_that_brings_it(bare_environment):
    code = f"""
import importlib
result = {{}}
for room in {list(ROOMS)}:
    try:
        importlib.import_module("dustfall." + room)
    except ModuleNotFoundError as error:
        result[room] = str(error)"""
    sentences = run(bare_environment, code)
    for room, extra in ROOMS.items():
        assert f"not installed; it comes by: pip install 'dustfall[{extra}]'" in sentences[room]
    with open(ROOT / "pyproject.toml", "rb") as file:
        extras = tomllib.load(file)["project"]["optional-dependencies"]
    assert set(ROOMS.values()) <= set(extras)


def test_the_command_line_solves_predicts_and_names_missing_extras(bare_environment, tmp_path):
    (tmp_path / "c.csv").write_text("0,0,0\n0,1.5,0\n")
    (tmp_path / "n.csv").write_text("2,0,0,0,3,0,0,0,4,-5,0,0,0,-6,0\n")
    commands = [
        "forces {0}/c.csv -o {0}/forces.npy",
        "predict {0}/n.csv -o {0}/predicted.csv",
        "forces {0}/c.csv -o {0}/forces.h5",
        "settle --particles 9 --phi 1e-3 -o {0}/run.nc",
        "train {0}/n.csv -o {0}/model.safetensors",
        "export anchored --to onnx -o {0}/model.onnx",
        "export {0}/run.nc --to vtkhdf -o {0}/run.vtkhdf",
        "view {0}/run.nc -o {0}/run.gif",
    ]
    code = f"""
from contextlib import redirect_stderr
from io import StringIO
from dustfall.cli import main
result = []
for command in {commands}:
    with redirect_stderr(StringIO()) as told:
        status = main([part.format({str(tmp_path)!r}) for part in command.split()])
    result.append([status, told.getvalue()])"""
    (solved, _), (predicted, _), *failed = run(bare_environment, code)
    assert solved == predicted == 0
    forces = np.load(tmp_path / "forces.npy")["force"]
    np.testing.assert_allclose(forces[0], forces[1], atol=24.0 * 1e-4)
    extras = ["files", "files", "train", "onnx", "files", "figures"]
    for (status, told), extra in zip(failed, extras, strict=True):
        assert status == 2
        assert re.fullmatch(rf"dustfall \w+: .* pip install 'dustfall\[{extra}\]'\n", told), told


def pins(file: str) -> dict[str, set[str]]:
    """Versions of each package of a file of requirements; a lock may have one for each Python."""
    found: dict[str, set[str]] = {}
    for line in (ROOT / file).read_text().splitlines():
        if pin := re.match(r"([\w.-]+)(?:\[\w+\])?==([^\s;]+)", line):
            name = re.sub(r"[-_.]+", "-", pin[1]).lower()
            found.setdefault(name, set()).add(pin[2])
    return found


def test_the_lock_holds_what_is_required_with_hashes():
    locked, required = pins("requirements.lock"), pins("requirements.txt")
    assert "torch" not in locked
    differing = {name for name in required if required[name] != locked.get(name)}
    assert differing == {"torch"}, "make lock"
    lines = (ROOT / "requirements.lock").read_text().replace("\\\n", "").splitlines()
    assert all("--hash=sha256:" in line for line in lines if not line.startswith("#"))


@pytest.mark.parametrize("room", ["forces", "stokes", "suspension.periodic"])
def test_solving_and_prediction_load_neither_their_tools_nor_other_rooms(room):
    code = f"import json, sys\nimport dustfall.{room}\nprint(json.dumps(list(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not set(json.loads(done.stdout)) & {*OTHER_PACKAGES, *OTHER_ROOMS}
