"""A campaign that is short of disk or of files, or is run twice, says so and goes on to its end."""

import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.faults.conftest import (
    SMOKE,
    TARGET,
    begin,
    copy_of,
    count,
    difference,
    locked,
    results,
)
from tests.workflow.conftest import Project

pytestmark = pytest.mark.faults

DISK = 64
"""Size of the disk that runs full [MiB]: a smoke campaign leaves less than half of it."""


@contextmanager
def small_disk(folder: Path):
    """A disk of its own in place of a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={DISK}m", "none", folder], capture_output=True
    )
    if done.returncode:
        pytest.skip("no right to mount a small disk here")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


def fill(path: Path) -> None:
    """Take all the room that a disk has."""
    with open(path, "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            pass


STAGES = [
    "results/scenes/uniform-0000.h5",
    "results/stokes/uniform-0000.h5",
    "results/dataset/forces.h5",
    "results/sweep/streamwise/10_10.json",
    "results/model/anchored.safetensors",
    "results/sedimentation/n100_phi1e-03_ga1_rotne_prager_long.nc",
    "results/analysis/steady_state.csv",
    "results/figures/inverse_beta.png",
]


def stopped(done: subprocess.CompletedProcess, cause: str) -> str:
    words = done.stdout + done.stderr
    last = words.rstrip().splitlines()[-1]
    told = done.returncode != 0 and last.startswith("Stopped: ") and cause in last
    return "detected" if told else f"crashed ({last})"


@pytest.mark.parametrize("file", STAGES)
def test_a_full_disk_is_told_at_every_stage_and_the_run_goes_on(whole, tmp_path, ledger, file):
    if not (whole.folder / file).exists():
        pytest.skip("this campaign does not make it")
    arguments = (*SMOKE, "--rerun-triggers", "mtime", "--", file)
    with small_disk(tmp_path / "results"):
        project = copy_of(whole, tmp_path)
        (project.folder / file).unlink()
        fill(tmp_path / "results/ballast")
        outcome = stopped(project.snakemake(*arguments), "the disk is full")
        (tmp_path / "results/ballast").unlink()
        project.run(*arguments)
        healed = "silent" if difference(project, whole) else "healed"
    count(ledger, "a full disk, at a stage", [outcome])
    count(ledger, "the same command after a full disk", [healed])


def test_a_folder_that_cannot_be_written_is_told(whole, tmp_path, ledger):
    with small_disk(tmp_path / "results"):
        project = copy_of(whole, tmp_path)
        (project.folder / STAGES[1]).unlink()
        subprocess.run(["mount", "-o", "remount,ro", tmp_path / "results"], check=True)
        arguments = (*SMOKE, "--rerun-triggers", "mtime", "--", STAGES[1])
        outcome = stopped(project.snakemake(*arguments), "the file system is read-only")
    count(ledger, "a folder of results that cannot be written", [outcome])


def test_a_campaign_half_deleted_is_made_whole(whole, tmp_path, ledger):
    project = copy_of(whole, tmp_path)
    # Of files that nothing asks for, this once took table and checksum.
    rng = np.random.default_rng(2)
    files = sorted(path for path in (tmp_path / "results").rglob("*") if path.is_file())
    for path in files:
        if rng.random() < 0.5:
            path.unlink()
    # A checksum without its file is made anew with its file. A file without its checksum is refused
    # by the first job that reads it; `verify`, which the sentence points to, names them all.
    arguments = (*SMOKE, "--", *TARGET)
    outcome = stopped(project.snakemake(*arguments), "`snakemake verify` names all such files")
    words = project.snakemake(*SMOKE, "--", "verify").stdout
    for part in words.split("(rm '")[1:]:
        (project.folder / part.split("'")[0]).unlink()
    project.run(*arguments)
    project.run(*SMOKE, "--", "verify")
    healed = "silent" if difference(project, whole) else "healed"
    count(ledger, "half of the files deleted", [outcome])
    count(ledger, "the same command after half of the files were deleted", [healed])


def test_of_two_runs_at_once_one_is_refused_and_the_other_ends(whole, tmp_path, ledger):
    project, target = Project(tmp_path), "results/dataset/forces.h5"
    first = begin(project, "--", target)
    while not locked(project):
        time.sleep(0.1)
    done = project.snakemake(*SMOKE, "--", target)
    words = done.stdout + done.stderr
    refused = done.returncode != 0 and "cannot be locked" in words and "--unlock" in words
    assert first.wait() == 0
    count(ledger, "a second run at once", ["detected" if refused else "silent"])
    undisturbed = results(whole)
    assert all(undisturbed[name] == content for name, content in results(project).items())
