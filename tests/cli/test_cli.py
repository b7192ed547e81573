"""The command line gives what the library gives, and errors of one sentence."""

import json
import re
import shlex
import signal
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from dustfall.cli import SUBCOMMANDS, main, parser
from dustfall.forces import FORMULAS, load_model
from dustfall.sedimentation.checkpoint import CURRENT
from dustfall.stokes import fixed_spheres
from tests.forces.scenes import random_neighbours

SETTLE = "settle --particles 60 --phi 1e-3 --model rotne_prager --duration 40 --save-every 10"


def run(command: str, *paths) -> int:
    """Status of a command line; `paths` fill its braces."""
    return main([part.format(*paths) for part in shlex.split(command)])


def columns(path) -> dict[str, np.ndarray]:
    """The columns of a csv file, by the names before their units."""
    names = [name.split(" ")[0] for name in path.read_text().splitlines()[0].split(",")]
    return dict(zip(names, np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2).T, strict=True))


@pytest.fixture
def centres(tmp_path):
    array = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.5], [2.0, 0.0, 0.0]])
    np.savetxt(tmp_path / "centres.csv", array, delimiter=",")
    return array


def test_forces_are_those_of_the_solver_with_their_error_estimates(tmp_path, centres, capsys):
    command = "forces {0}/centres.csv -o {0}/forces.csv --flow 0 -1e-3 2 --tolerance 1e-5"
    assert run(command, tmp_path) == 0
    solution = fixed_spheres(centres, (0, -1e-3, 2), 1e-5)
    found = columns(tmp_path / "forces.csv")
    names = ["x", "y", "z", "force_x", "force_y", "force_z", "error_estimate"]
    expected = np.column_stack([centres, solution.force, solution.error_estimate])
    assert list(found) == names
    np.testing.assert_array_equal(np.transpose(list(found.values())), expected)
    assert "3 spheres, converged" in capsys.readouterr().err


def test_without_a_file_to_write_the_same_table_is_printed(tmp_path, centres, capsys):
    assert run("forces {0}/centres.csv -o {0}/forces.csv", tmp_path) == 0
    assert run("forces {0}/centres.csv", tmp_path) == 0
    assert capsys.readouterr().out == (tmp_path / "forces.csv").read_text()


def test_a_result_is_read_as_what_it_was_made_from(tmp_path, centres):
    assert run("forces {0}/centres.csv -o {0}/forces.h5", tmp_path) == 0
    assert run("forces {0}/forces.h5 -o {0}/again.npy", tmp_path) == 0
    assert run("forces {0}/again.npy -o {0}/forces.csv", tmp_path) == 0
    again = np.load(tmp_path / "again.npy")
    np.testing.assert_array_equal(again["centre"], centres)
    np.testing.assert_array_equal(columns(tmp_path / "forces.csv")["force_y"], again["force"][:, 1])


@pytest.mark.parametrize(("name", "model"), [("anchored", load_model()), *FORMULAS.items()])
def test_predictions_are_those_of_the_model(tmp_path, name, model):
    neighbours = random_neighbours(9, seed=1)
    np.save(tmp_path / "neighbours.npy", neighbours)
    assert run("predict {0}/neighbours.npy --model {1} -o {0}/forces.csv", tmp_path, name) == 0
    found = columns(tmp_path / "forces.csv")
    assert list(found)[:3] == ["x1", "y1", "z1"]
    forces = np.transpose([found[f"force_{axis}"] for axis in "xyz"])
    np.testing.assert_array_equal(forces, model.predict(neighbours))


def test_a_run_that_is_killed_goes_on_to_the_same_bits_by_the_same_command(tmp_path):
    for name in ("whole", "killed"):
        (tmp_path / name).mkdir()
    assert run(f"{SETTLE} -o {{0}}/run.nc", tmp_path / "whole") == 0
    command = f"{SETTLE} -o {tmp_path / 'killed' / 'run.nc'} --checkpoint-interval 0"
    state = tmp_path / "killed" / "run.checkpoint" / CURRENT
    process = subprocess.Popen([sys.executable, "-m", "dustfall", *shlex.split(command)])
    while not state.exists():
        assert process.poll() is None
    process.kill()
    assert process.wait() == -signal.SIGKILL
    assert main(shlex.split(command)) == 0
    names = ["run.nc", "run.series.nc"]
    assert sorted(path.name for path in (tmp_path / "killed").iterdir()) == names
    for name in names:
        whole, killed = (
            xr.load_dataset(tmp_path / folder / name) for folder in ("whole", "killed")
        )
        assert whole.identical(killed)


def test_a_run_that_is_whole_is_not_begun_anew(tmp_path, capsys):
    command = "settle --particles 10 --phi 1e-3 --model isolated --duration 1 -o {0}/run.nc"
    assert run(command, tmp_path) == 0
    assert run(command, tmp_path) == 2
    assert "is there, and whole: remove it" in capsys.readouterr().err


@pytest.mark.parametrize("left", [[], ["frames.bin", "series.bin"], [".nfs0001"]])
def test_a_run_that_is_whole_but_left_its_folder_is_not_begun_anew(tmp_path, capsys, left):
    command = "settle --particles 10 --phi 1e-3 --model isolated --duration 1 -o {0}/run.nc"
    assert run(command, tmp_path) == 0
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    folder = tmp_path / "run.checkpoint"
    folder.mkdir()
    for name in left:
        (folder / name).touch()
    assert run(f"{command} --diameter 1e-5", tmp_path) == 2
    assert "is there, and whole: remove it" in capsys.readouterr().err
    assert before == {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    # What is not the run's own stays.
    assert folder.exists() == (left == [".nfs0001"])


def test_a_run_starts_from_a_table_or_from_where_another_ended(tmp_path):
    position = 10.0 * np.argwhere(np.ones((3, 2, 2))) + np.random.default_rng(1).random((12, 3))
    names = "x [d_p],y [d_p],z [d_p]"
    np.savetxt(tmp_path / "start.csv", position, "%.17g", ",", header=names, comments="")
    options = "--phi 1e-4 --model isolated --duration 1 --precision float64 --save-every 0.5"
    assert run(f"settle {{0}}/start.csv {options} -o {{0}}/one.nc", tmp_path) == 0
    assert run(f"settle {{0}}/one.nc {options} -o {{0}}/two.nc", tmp_path) == 0
    one, two = (xr.load_dataset(tmp_path / f"{name}.nc") for name in ("one", "two"))
    np.testing.assert_array_equal(one.coordinates[0], position)
    np.testing.assert_array_equal(two.coordinates[0], one.coordinates[-1])


def test_all_particles_settle_with_the_properties_given(tmp_path):
    command = (
        "settle --particles 60 --phi 1e-2 --closure all_particles --fluid quasi_steady "
        "--duration 0.2 --save-every 0.1 --diameter 1e-5 -o {0}/run.nc"
    )
    assert run(command, tmp_path) == 0
    attributes = xr.load_dataset(tmp_path / "run.nc").attrs
    assert attributes["closure"] == "all_particles"
    assert attributes["fluid"] == "quasi_steady"
    assert attributes["diameter"] == 1e-5


def test_a_model_is_trained_to_the_same_bits_and_predicts_and_is_exported(tmp_path, samples):
    neighbours, force = samples
    table = np.empty(400, [("neighbours", "f8", neighbours.shape[1:]), ("force", "f8", 3)])
    table["neighbours"], table["force"] = neighbours[:400], force[:400]
    np.save(tmp_path / "samples.npy", table)
    train = "train {0}/samples.npy --kind idnn --layers 8/8 --epochs 4 --batch-size 64"
    for name in "ab":
        assert run(f"{train} -o {{0}}/{name}.safetensors", tmp_path) == 0
    model = load_model(tmp_path / "a.safetensors")
    scenes = neighbours[400:420]
    other = load_model(tmp_path / "b.safetensors")
    np.testing.assert_array_equal(model.predict(scenes), other.predict(scenes))
    assert model.header["training"]["settings"]["epochs"] == 4
    assert model.header["training"]["command"].startswith("dustfall train")
    np.save(tmp_path / "scenes.npy", scenes)
    model_file = tmp_path / "a.safetensors"
    assert run("predict {0}/scenes.npy --model {1} -o {0}/f.csv", tmp_path, model_file) == 0
    found = columns(tmp_path / "f.csv")
    np.testing.assert_array_equal(found["force_y"], model.predict(scenes)[:, 1])
    for kind in ("json", "openfoam", "onnx"):
        assert run("export {0} --to {1} -o {0}.{1}", model_file, kind) == 0
    written = json.loads((tmp_path / "a.safetensors.json").read_text())
    tests = np.reshape(written["test_scenes"], (-1, 5, 3))
    np.testing.assert_array_equal(np.ravel(model.predict(tests)), written["test_forces"])


def test_a_formula_is_exported_for_as_many_neighbours_as_one_wants(tmp_path):
    command = "export rotne_prager --to json --neighbours 3 -o {0}/model.json"
    assert run(command, tmp_path) == 0
    assert json.loads((tmp_path / "model.json").read_text())["neighbours"] == 3


def test_training_on_a_force_that_does_not_vary_says_that_it_has_no_score(tmp_path, capsys):
    rows = np.hstack([random_neighbours(20, number=1)[:, 0], np.tile([0.0, 24.0, 0.0], (20, 1))])
    np.savetxt(tmp_path / "samples.csv", rows, delimiter=",")
    command = "train {0}/samples.csv --kind dense --layers 4 --epochs 1 -o {0}/m.safetensors"
    assert run(command, tmp_path) == 0
    assert "streamwise none, it is the same in all" in capsys.readouterr().err


ERRORS = {
    "": "required: COMMAND; see dustfall --help",
    "settel": "invalid choice: 'settel'",
    "forces": "required: centres; see dustfall forces --help",
    "forces missing.csv": "there is no file missing.csv",
    "forces {0}/c.csv -o {0}/f.xlsx": r"f\.xlsx is no table by its suffix: allowed are \.csv",
    "forces {0}/c.csv --flow 0 1": "--flow: expected 3 arguments",
    "forces {0}/c.csv --flow 0 nan 0": "flow must be three finite numbers",
    "forces {0}/c.csv --tolerance 1e-12": "tolerance 1e-12: allowed are 1e-08 to 0.1",
    "forces {0}/c.csv --method magic": "method 'magic': allowed are multipole",
    "forces {0}/c.csv -o {0}/c.csv/f.csv": "c.csv: .*",
    "forces {0}/overlap.csv": "spheres 0 and 1 overlap or touch",
    "forces {0}/words.csv": r"words\.csv: there is no column x among",
    "predict {0}/c.csv": "the model takes .* k = 5",
    "predict {0}/c.csv --model oracle": "no model 'oracle': allowed are anchored, isolated",
    "predict {0}/c.csv --model no.safetensors": "there is no file no.safetensors",
    "settle --particles 9 --phi 1e-3 -o run.vtk": "a trajectory has the suffix .nc",
    "settle --phi 1e-3 -o {0}/run.nc": "a file to start from, or --particles",
    "settle {0}/c.csv --particles 9 --phi 1e-3 -o {0}/run.nc": "one is needed",
    "settle --particles 9 --phi 2 -o {0}/run.nc": "phi is 2.0: allowed is",
    "settle --particles 9 --phi 1e-3 --step 0.3 -o {0}/run.nc": "multiple of the step",
    "settle --particles 9 --phi 1e-3 --duration 2.5 -o {0}/run.nc": "multiple of save_interval, 1",
    "settle --particles 9 --phi 1e-3 --diameter 0 -o {0}/run.nc": "diameter is 0.0",
    "settle --particles 9 --phi 1e-3 --fluid unsteady -o {0}/run.nc": "nearest_neighbours has none",
    "settle --particles 9 --phi 1e-3 --closure all_particles --model isolated -o {0}/run.nc":
        "all_particles has none",
    "train {0}/c.csv -o model.safetensors": "3 columns without names are not neighbours",
    "train {0}/c.csv -o model.pt": r"a model has the suffix \.safetensors",
    "train {0}/c.csv --kind gpt -o m.safetensors": "kind is 'gpt': allowed are dense",
    "export anchored --to vtkhdf -o {0}/x": "anchored is written as openfoam, json, onnx",
    "export isolated --to json --neighbours 0 -o {0}/x": "0 neighbours: allowed are 1 to 50",
    "export anchored --to json --neighbours 3 -o {0}/x": "3 neighbours: the model takes 5",
    "export anchored --to onnx --neighbours 7 -o {0}/x": "7 neighbours: the model takes 5",
    "export run.nc --to json -o {0}/x": "run.nc is written as vtkhdf",
    "export isolated --to onnx -o {0}/x": "isolated has no networks",
    "export anchored --to json --units si -o {0}/x": "--units means nothing to the format json",
    "view {0}/missing.nc -o {0}/x.gif": "there is no file .*missing.nc",
    "view {0}/c.csv -o {0}/x.gif": "c.csv is damaged or no NetCDF file",
    "export {0}/missing.nc --to pvd -o {0}/x.pvd": "there is no file .*missing.nc",
}  # fmt: skip


@pytest.mark.parametrize(("command", "told"), ERRORS.items(), ids=range(len(ERRORS)))
def test_an_error_is_one_sentence_that_says_what_is_wrong(tmp_path, capsys, command, told):
    (tmp_path / "c.csv").write_text("0,0,0\n2,0,0\n")
    (tmp_path / "overlap.csv").write_text("0,0,0\n0.5,0,0\n")
    (tmp_path / "words.csv").write_text("a,b,c\n0,0,0\n")
    before = sorted(tmp_path.rglob("*"))
    try:
        status = run(command, tmp_path)
    except SystemExit as end:
        status = end.code
    assert status == 2
    sentence = capsys.readouterr().err
    assert re.fullmatch(rf"dustfall[a-z ]*: .*{told}.*\n", sentence), sentence
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_stopped_says_so_and_has_the_status_of_an_interruption(
    tmp_path, capsys, monkeypatch, number
):
    def stop(progress, done, total):
        if done == 7:
            signal.raise_signal(number)

    monkeypatch.setattr("dustfall.progress.Progress.report", stop)
    command = "settle --particles 10 --phi 1e-3 --model isolated --duration 2 -o {0}/run.nc"
    assert run(command, tmp_path) == 130
    told = capsys.readouterr().err
    assert re.fullmatch(r"dustfall settle: terminated after step 8 of 20, .*\n", told), told


def test_more_spheres_than_the_memory_takes_are_refused_before_any_distance(
    tmp_path, capsys, monkeypatch
):
    def distances(*arguments):
        raise AssertionError

    monkeypatch.setattr("dustfall.spheres.centre_distances", distances)
    monkeypatch.setattr("dustfall.stokes.memory.available_memory", lambda: 2**30)
    np.save(tmp_path / "c.npy", 2.0 * np.argwhere(np.ones((20, 20, 10))))
    assert run("forces {0}/c.npy", tmp_path) == 2
    told = r"dustfall forces: 4000 spheres take 1\.2 GiB .*: only 1\.0 GiB of memory .*\n"
    assert re.fullmatch(told, capsys.readouterr().err)


EXAMPLES = [line.strip() for module in SUBCOMMANDS.values() for line in module.EXAMPLES.split("\n")]


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_of_the_help_is_a_command(example):
    program, *arguments = shlex.split(example)
    assert program == "dustfall"
    assert parser().parse_args(arguments).subcommand == arguments[0]


@pytest.mark.parametrize("subcommand", SUBCOMMANDS)
def test_help_loads_no_numerical_library(subcommand):
    code = (
        "import sys\nfrom dustfall.cli import main\n"
        f"try:\n    main(['{subcommand}', '--help'])\n"
        "except SystemExit as end:\n    assert end.code == 0\n"
        "assert not set(sys.modules) & {'numpy', 'numba', 'scipy'}"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "examples:" in done.stdout
