"""A campaign that is killed and interrupted at random moments goes on to the same bits."""

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.faults.conftest import KILLS, SMOKE, TARGET, begin, count, difference, end, locked
from tests.workflow.conftest import Project

pytestmark = pytest.mark.faults

INTERRUPTIONS = max(2, KILLS // 10)

WHILE_PLANNING = 0.25
"""Share of the kills that meet Snakemake before it has planned; an interrupt then stops nothing."""

LAST = 6
"""Files at the end of a campaign that no signal waits for; they take longer than `MOMENT`."""

MOMENT = 2.0
"""The signal comes at most so long after as many files as it waits for [s]."""


def unlock(project: Project) -> None:
    """What `snakemake --unlock` does, without its start."""
    shutil.rmtree(project.folder / ".snakemake/locks", ignore_errors=True)


def leftovers(project: Project) -> list[Path]:
    """Temporary files, copies of scripts and empty folders."""
    found = [*(project.folder / "results").rglob(".*")]
    found += (project.folder / ".snakemake/scripts").glob("*")
    found += (
        folder
        for folder, inner, files in os.walk(project.folder / "results")
        if not inner and not files
    )
    return found


STOPS = {
    signal.SIGKILL: "kill -9 of the process group at a random moment",
    signal.SIGINT: "SIGINT to the process group",
    signal.SIGTERM: "SIGTERM to the process group",
}


def planned(project: Project) -> tuple[int, float]:
    """Number of files that the campaign makes, and seconds that Snakemake takes to plan them."""
    began = time.monotonic()
    lines = project.run(*SMOKE, "--summary", "--", *TARGET).splitlines()
    files = [line for line in lines if line.startswith("results/")]
    return len(files), time.monotonic() - began


def files_of(project: Project) -> int:
    """Number of files that the campaign has made."""
    return sum(1 for _ in (project.folder / "results/checksums").rglob("*.sha256"))


def wait_for(condition: Callable[[], bool], process: subprocess.Popen) -> None:
    """Wait until something holds, or the process has ended."""
    while process.poll() is None and not condition():
        time.sleep(0.1)


def stopped_run(
    project: Project,
    number: int,
    files: int | None,
    seconds: float,
    at_its_end: Callable[[], None],
) -> str:
    """Words of a run that a signal met, `seconds` after it began or had made so many files."""
    while True:
        process = begin(
            project, "--", *TARGET, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        if files is not None:
            wait_for(lambda: locked(project) and files_of(project) >= files, process)
        try:
            words, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            end(process, number)
            words, _ = process.communicate()
        if process.returncode:
            assert number != signal.SIGKILL or process.returncode == -signal.SIGKILL
            return words
        # At its end before the moment came: once more from the beginning.
        at_its_end()
        shutil.rmtree(project.folder / "results")


def test_a_campaign_stopped_at_random_moments_says_why_and_ends_with_the_same_bits(
    tmp_path, ledger, request
):
    project, rng, outcomes = Project(tmp_path), np.random.default_rng(0), []

    def compare():
        # Asked for as late as this, the undisturbed campaign may run in another process meanwhile.
        whole = request.getfixturevalue("whole")
        outcomes.append("silent" if difference(project, whole) else "healed")
        assert files_of(project) == made

    made, start = planned(project)
    kills, interruptions = [signal.SIGKILL] * KILLS, [signal.SIGINT, signal.SIGTERM] * INTERRUPTIONS
    numbers = rng.permutation(kills + interruptions)
    # In order, the stops go through to the campaign's end once.
    moments = np.sort(rng.integers(max(1, made - LAST), size=len(numbers)))
    for number, files in zip(numbers, moments, strict=True):
        if number == signal.SIGKILL and rng.random() < WHILE_PLANNING:
            words = stopped_run(project, number, None, rng.uniform(0, start), compare)
        else:
            words = stopped_run(project, number, files, rng.uniform(0, MOMENT), compare)
        if number == signal.SIGKILL:
            unlock(project)
        else:
            last = words.rstrip().splitlines()[-1]
            # Jobs that are hit while Python still starts show its own words further up.
            told = last.startswith("Stopped: ") and "To go on: snakemake" in last
            count(ledger, STOPS[number], ["detected" if told else f"crashed ({last})"])

    unlock(project)
    project.run(*SMOKE, "--", *TARGET)
    left = leftovers(project)
    assert not left, left
    compare()
    outcome = "silent" if "silent" in outcomes else "healed"
    count(ledger, STOPS[signal.SIGKILL], KILLS * [outcome])
    count(ledger, "the same command after kills and interrupts", outcomes)
