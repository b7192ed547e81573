"""Damage on disk is told by a sentence, or changes nothing: cut, emptied, single bits flipped."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from dustfall import dataset
from dustfall.columns import read_columns, write_columns
from dustfall.forces.learned import SHIPPED, load_model
from dustfall.scenes import SCENE_COLUMNS, random_scenes
from dustfall.sedimentation.start import read_start
from dustfall.sedimentation.trajectory import open_run
from tests.faults.conftest import FLIPS, copy_of, count, damages, difference, judge
from tests.sedimentation.runs import run
from workflow import checksums

POINTS = np.random.default_rng(0).normal(scale=4.0, size=(50, 5, 3)) + 1.5
"""Neighbours at which models are compared."""


class Stop(Exception):
    """Ends a run at a chosen step."""


@pytest.fixture(scope="module")
def artefacts(tmp_path_factory) -> Path:
    """One file of each kind that the library reads."""
    folder = tmp_path_factory.mktemp("artefacts")
    neighbours, phi = random_scenes(1, "uniform", range(40), (1e-6, 1e-3))
    scenes = {"neighbours": neighbours, "volume_fraction": phi, "scene": np.arange(40)}
    write_columns(folder / "scenes.h5", SCENE_COLUMNS, scenes)
    force = np.random.default_rng(1).normal(size=(40, 3))
    columns = dataset.Dataset(force=force, radial_law=np.full(40, "uniform"), **scenes)
    dataset.write(folder / "forces.h5", columns, {"seed": 1})
    shutil.copy(SHIPPED, folder / "model.safetensors")
    run(folder, particles=40, name="case")
    return folder


def numbers(found) -> bytes:
    """All bits of nested arrays."""
    if isinstance(found, dict):
        return b"".join(numbers(value) for value in found.values())
    if isinstance(found, tuple):
        return b"".join(map(numbers, found))
    if found is None:
        return b""
    return b"".join([str(found.dtype).encode(), found.tobytes()])


def series(path) -> dict:
    with open_run(path) as file:
        return {name: np.asarray(file[name][:]) for name in file.variables}


READERS = {
    "scenes.h5": lambda path: read_columns(path, SCENE_COLUMNS),
    "forces.h5": lambda path: vars(dataset.read(path)),
    "model.safetensors": lambda path: load_model(path).predict(POINTS),
    "case.nc": lambda path: read_start(path, 40, 1e-3),
    "case.series.nc": series,
}


def damage_all(folder: Path, scratch: Path, name: str, flips: int) -> list[str]:
    whole, path = (folder / name).read_bytes(), scratch / name
    read = READERS[name]
    expected = numbers(read(folder / name))
    outcomes = []
    for content in damages(whole, flips, seed=len(name)):
        path.write_bytes(content)
        outcomes.append(judge(lambda: numbers(read(path)), lambda bits: bits == expected, name))
    return outcomes


@pytest.mark.parametrize("name", READERS)
def test_a_reader_tells_damage_or_reads_the_same(artefacts, tmp_path, ledger, name):
    count(ledger, f"a few in {name}", damage_all(artefacts, tmp_path, name, flips=2))


@pytest.mark.faults
@pytest.mark.parametrize("name", READERS)
def test_a_reader_tells_any_damage_or_reads_the_same(artefacts, tmp_path, ledger, name):
    outcomes = damage_all(artefacts, tmp_path, name, FLIPS)
    count(ledger, f"damage in {name}, by the library's reader", outcomes)


@pytest.mark.faults
@pytest.mark.parametrize("file", ["state.bin", "state.previous.bin", "frames.bin", "series.bin"])
def test_a_run_heals_any_damage_of_its_checkpoint(tmp_path, ledger, file):
    def stop(done, total):
        if done == 11:
            raise Stop

    whole, folder, saved = (tmp_path / name for name in ("whole", "run", "saved"))
    run(whole, particles=40)
    expected = (whole / "case.nc").read_bytes(), (whole / "case.series.nc").read_bytes()
    with pytest.raises(Stop):
        run(saved, particles=40, checkpoint=saved / "c", checkpoint_interval=0.0, progress=stop)

    def go_on():
        run(folder, particles=40, checkpoint=folder / "c")
        return (folder / "case.nc").read_bytes(), (folder / "case.series.nc").read_bytes()

    outcomes = []
    for content in damages((saved / "c" / file).read_bytes(), FLIPS, seed=3):
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(saved, folder)
        (folder / "c" / file).write_bytes(content)
        outcome = judge(go_on, lambda found: found == expected, "no refusal is right")
        outcomes.append("healed" if outcome == "harmless" else outcome)
    count(ledger, f"damage in {file} of a checkpoint", outcomes)


@pytest.mark.faults
def test_no_file_of_a_campaign_is_damaged_unseen(whole, tmp_path, ledger, monkeypatch):
    project = copy_of(whole, tmp_path)
    monkeypatch.chdir(project.folder)
    files = [path for path, complaint in checksums.verify() if not complaint]
    outcomes = []
    for path in files:
        content = path.read_bytes()
        for damaged in damages(content, FLIPS, seed=len(content)):
            path.write_bytes(damaged)
            try:
                checksums.check([path])
            except checksums.DamageError as error:
                outcomes.append("detected" if str(path) in str(error) else "silent")
            else:
                outcomes.append("harmless" if damaged == content else "silent")
        path.write_bytes(content)
    count(ledger, "damage in the files of a campaign, by the checksums", outcomes)


STAGES = {
    "results/scenes/uniform-0000.h5": "results/stokes/uniform-0000.h5",
    "results/stokes/uniform-0000.h5": "results/dataset/forces.h5",
    "results/dataset/forces.h5": "results/sweep/streamwise/10_10.json",
    "results/sweep/streamwise/10_10.json": "results/sweep/winner.json",
    "results/sweep/winner.json": "results/model/idnn.safetensors",
    "results/model/anchored.safetensors": "results/model/evaluation.csv",
    "results/model/predictions.h5": "results/figures/error_by_distance.png",
    "results/analysis/steady_state.csv": "results/figures/inverse_beta.png",
}
"""A file of each stage, and one that is made from it."""


@pytest.mark.faults
@pytest.mark.parametrize("file", STAGES)
def test_a_job_refuses_a_damaged_file_and_its_advice_heals_it(whole, tmp_path, ledger, file):
    if not (whole.folder / STAGES[file]).exists():
        pytest.skip("this campaign does not make it")
    project, reader = copy_of(whole, tmp_path), STAGES[file]
    path = project.folder / file
    damaged = bytearray(path.read_bytes())
    damaged[len(damaged) // 2] ^= 1
    times = path.stat()
    path.write_bytes(damaged)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    (project.folder / reader).unlink()
    arguments = ("--configfile", "config/smoke.yaml", "--rerun-triggers", "mtime", "--", reader)
    done = project.snakemake(*arguments)
    last = (done.stdout + done.stderr).rstrip().splitlines()[-1]
    told = done.returncode == 1 and f"{file} is damaged" in last and "To go on: " in last
    path.unlink()
    project.run(*arguments)
    healed = not difference(project, whole)
    count(
        ledger, "a flipped bit before a stage of the campaign", ["detected" if told else "silent"]
    )
    count(ledger, "the advice of the sentence followed", ["healed" if healed else "silent"])
