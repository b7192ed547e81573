"""A campaign that is killed, interrupted, short of disk or of files goes on to the same bits."""

import os
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from tests.faults.conftest import (
    KILLS,
    SMOKE,
    TARGET,
    begin,
    count,
    difference,
    end,
)
from tests.workflow.conftest import Project

pytestmark = pytest.mark.faults

INTERRUPTIONS = max(2, KILLS // 10)

SIDE_BY_SIDE = 2
"""Campaigns that are stopped again and again at once."""

DISK = 64
"""Size of the disk that runs full [MiB]: a smoke campaign leaves less than half of it."""


@pytest.fixture(scope="module")
def start_up(whole) -> float:
    """Seconds that Snakemake needs here until its first job."""
    began = time.monotonic()
    whole.dry_run(*SMOKE, "--", *TARGET)
    return time.monotonic() - began


def unlock(project: Project) -> None:
    """What `snakemake --unlock` does, without its start."""
    shutil.rmtree(project.folder / ".snakemake/locks", ignore_errors=True)


def locked(project: Project) -> bool:
    """Whether a run of Snakemake has begun that has not ended."""
    return any((project.folder / ".snakemake/locks").glob("*"))


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


def finish(project: Project, whole: Project) -> str:
    unlock(project)
    project.run(*SMOKE, "--", *TARGET)
    left = leftovers(project)
    assert not left, left
    return "silent" if difference(project, whole) else "healed"


STOPS = {
    signal.SIGKILL: "kill -9 of the process group at a random moment",
    signal.SIGINT: "SIGINT to the process group",
    signal.SIGTERM: "SIGTERM to the process group",
}


def stopped_run(project: Project, whole: Project, number: int, start_up: float, rng) -> str:
    """Words of a run that a signal met at a random moment."""
    while True:
        process = begin(
            project, "--", *TARGET, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        # A kill comes at any moment; an interrupt once there is a campaign that could stop.
        if number == signal.SIGKILL:
            moment = rng.uniform(0.5, 3.0)
        else:
            moment = rng.uniform(0.0, 1.5)
            while process.poll() is None and not locked(project):
                time.sleep(0.1)
        try:
            words, _ = process.communicate(timeout=start_up * moment)
        except subprocess.TimeoutExpired:
            end(process, number)
            words, _ = process.communicate()
        if process.returncode:
            assert number != signal.SIGKILL or process.returncode == -signal.SIGKILL
            return words
        # At its end before the moment came: once more.
        assert not difference(project, whole)
        shutil.rmtree(project.folder / "results")


def stop_at_random(
    project: Project, whole: Project, signals: list[int], start_up: float, seed: int
) -> list[tuple[str, str]]:
    """Stop a campaign by each of the signals, then let it end; faults and their outcomes."""
    rng, found = np.random.default_rng(seed), []
    for number in rng.permutation(signals):
        words = stopped_run(project, whole, number, start_up, rng)
        if number == signal.SIGKILL:
            unlock(project)
        else:
            last = words.rstrip().splitlines()[-1]
            # Jobs that are hit while Python still starts show its own words further up.
            told = last.startswith("Stopped: ") and "To go on: snakemake" in last
            found.append((STOPS[number], "detected" if told else f"crashed ({last})"))
    outcome = finish(project, whole)
    found += signals.count(signal.SIGKILL) * [(STOPS[signal.SIGKILL], outcome)]
    return [*found, ("the same command after kills and interrupts", outcome)]


def test_a_campaign_stopped_at_random_moments_says_why_and_ends_with_the_same_bits(
    whole, tmp_path, ledger, start_up
):
    half = [signal.SIGKILL] * (KILLS // SIDE_BY_SIDE)
    half += [signal.SIGINT, signal.SIGTERM] * (INTERRUPTIONS // SIDE_BY_SIDE)

    def campaign(seed):
        return stop_at_random(Project(tmp_path / str(seed)), whole, half, start_up, seed)

    # Most of such a run is the start of Snakemake, which takes one core.
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        found = [pair for pairs in pool.map(campaign, range(SIDE_BY_SIDE)) for pair in pairs]
    for fault in dict.fromkeys(fault for fault, _ in found):
        count(ledger, fault, [outcome for own, outcome in found if own == fault])
