"""A campaign that is killed and interrupted at random moments goes on to the same bits."""

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.faults.conftest import KILLS, SMOKE, TARGET, begin, count, difference, end, locked
from tests.workflow.conftest import Project

pytestmark = pytest.mark.faults

INTERRUPTIONS = max(2, KILLS // 10)

WHILE_PLANNING = 0.25
"""Share of the kills that meet Snakemake before it has planned; an interrupt then stops nothing."""

FILES = 2.0
"""Files that a campaign makes between its plan and the signal, on average of Poisson's law: some
stops meet the jobs that it went on with, and a hundred of them go through to its end."""

MOMENT = 2.0
"""The signal comes at most so long after that [s]."""


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


def start_up(project: Project) -> float:
    """Seconds that Snakemake needs here until its first job."""
    began = time.monotonic()
    project.dry_run(*SMOKE, "--", *TARGET)
    return time.monotonic() - began


def files_of(project: Project) -> int:
    """Number of files that the campaign has made."""
    return sum(1 for _ in (project.folder / "results/checksums").rglob("*.sha256"))


def has_made(project: Project, number: int) -> bool:
    return files_of(project) >= number


def wait_for(condition: Callable[[], bool], process: subprocess.Popen) -> None:
    """Wait until something holds, or the process has ended."""
    while process.poll() is None and not condition():
        time.sleep(0.1)


def stopped_run(
    project: Project, number: int, start: float, rng, at_its_end: Callable[[], None]
) -> str:
    """Words of a run that a signal met at a random moment."""
    while True:
        process = begin(
            project, "--", *TARGET, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        if number == signal.SIGKILL and rng.random() < WHILE_PLANNING:
            moment = rng.uniform(0, start)
        else:
            wait_for(partial(locked, project), process)
            wait_for(partial(has_made, project, files_of(project) + rng.poisson(FILES)), process)
            moment = rng.uniform(0, MOMENT)
        try:
            words, _ = process.communicate(timeout=moment)
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

    start = start_up(project)
    kills, interruptions = [signal.SIGKILL] * KILLS, [signal.SIGINT, signal.SIGTERM] * INTERRUPTIONS
    for number in rng.permutation(kills + interruptions):
        words = stopped_run(project, number, start, rng, compare)
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
