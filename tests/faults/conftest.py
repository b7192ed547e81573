"""What the fault tests share: a whole campaign, damage, a judge that outlives a crash, a ledger.

The full campaign of faults is `make fault-test`, which writes its counts into docs/faults.md. On a
slow machine environment variables make it smaller: FAULT_KILLS, FAULT_TARGET (what the campaign
makes), FAULT_FLIPS. The table says how many were tried.

Two processes run it. Stops take turns with starts of Snakemake, which use one core; so the other
process has the undisturbed campaign and what is done to copies of it.
"""

import fcntl
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.workflow.conftest import Project

KILLS = int(os.environ.get("FAULT_KILLS", "100"))
FLIPS = int(os.environ.get("FAULT_FLIPS", "20"))
TARGET = os.environ.get("FAULT_TARGET", "all").split()
TABLE = os.environ.get("FAULT_TABLE")
"""Page whose table takes the counts, if any."""

RULE = "|---" * 7 + "|"
"""Line under the head of that table, the last one of the page."""

SMOKE = ("--configfile", "config/smoke.yaml")

OUTCOMES = ("detected", "healed", "harmless", "silent", "crashed")
"""Told by a sentence; undone by itself, to the same bits; of no effect on what is read; of an
effect and not told; a signal, a hang, or an error that nobody wrote a sentence for."""

LONGEST = 60.0
"""Seconds after which a reader counts as hung."""

MOST_BYTES = 2 * 2**30
"""Memory that a reader may ask for, beyond what Python and its libraries have."""


# A job that a shell put into the background ignores it, and so do all that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def ledger() -> Iterator[dict[str, Counter]]:
    """Counts of outcomes by what was tried; the table takes them up at the end."""
    counts: dict[str, Counter] = {}
    yield counts
    if TABLE:
        with one_at_a_time(Path(TABLE)):
            write_table(Path(TABLE), counts)


@contextmanager
def one_at_a_time(file: Path) -> Iterator[None]:
    """Keep other processes from what `file` stands for; it has to be there."""
    with open(file, "rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def write_table(page: Path, counts: dict[str, Counter]) -> None:
    """Put rows into the table at the end of a page, those of the same name in place of old ones."""
    head, rule, table = page.read_text(encoding="utf-8").rpartition(RULE)
    rows = {row.split("|")[1].strip(): row for row in table.strip().splitlines()}
    for fault, count in counts.items():
        found = [sum(count.values()), *(count[outcome] for outcome in OUTCOMES)]
        rows[fault] = f"| {fault} | {' | '.join(map(str, found))} |"
    page.write_text("\n".join([f"{head}{rule}", *rows.values(), ""]), encoding="utf-8")


def damages(whole: bytes, flips: int, seed: int) -> Iterator[bytes]:
    """The content of a file cut, emptied, and with single bits flipped at random."""
    yield whole[: len(whole) // 2]
    yield b""
    rng = np.random.default_rng(seed)
    for _ in range(flips):
        damaged = bytearray(whole)
        damaged[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        yield bytes(damaged)


def judge(read: Callable[[], object], same: Callable[[object], bool], names: str) -> str:
    """Outcome of reading, in a process of its own: a refusal has to be one line that `names` it."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    child = multiprocessing.get_context("fork").Process(target=_read, args=(read, same, sender))
    child.start()
    sender.close()
    try:
        found = receiver.recv() if receiver.poll(LONGEST) else "hung"
    except EOFError:
        found = "died"
    if child.is_alive():
        child.join(5)
        child.kill()
    child.join()
    if found in ("harmless", "silent"):
        return found
    kind, _, words = found.partition(": ")
    told = kind in ("ValueError", "FileNotFoundError") and names in words and "\n" not in words
    return "detected" if told else f"crashed ({found})"


def _read(read, same, sender) -> None:
    import resource

    now = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + MOST_BYTES, now + MOST_BYTES))
    try:
        found = "harmless" if same(read()) else "silent"
    except BaseException as error:
        found = f"{type(error).__name__}: {error}"
    sender.send(found)


def count(ledger: dict[str, Counter], fault: str, outcomes: list[str]) -> None:
    """Enter outcomes; none may be silent or a crash."""
    ledger.setdefault(fault, Counter()).update(outcome.split(" ")[0] for outcome in outcomes)
    bad = [outcome for outcome in outcomes if outcome.startswith(("silent", "crashed"))]
    assert not bad, f"{fault}: {len(bad)} of {len(outcomes)}: {bad[:3]}"


@pytest.fixture(scope="session")
def whole(tmp_path_factory) -> Project:
    """A campaign that nothing disturbed, the same one for all processes of the tests."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "whole"
    folder.mkdir(exist_ok=True)
    ended, lock = folder / "ended", folder / "lock"
    lock.touch()
    with one_at_a_time(lock):
        project = Project(folder)
        if not ended.exists():
            project.run(*SMOKE, "--", *TARGET)
            ended.touch()
    return project


def results(project: Project) -> dict[str, bytes]:
    """Content of all files of a campaign."""
    folder = project.folder / "results"
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def difference(project: Project, whole: Project) -> list[str]:
    """Files that two campaigns do not have in common to the last bit."""
    one, other = results(project), results(whole)
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def copy_of(whole: Project, folder: Path) -> Project:
    """A copy of a campaign with its results, and with what Snakemake knows about them."""
    project = Project(folder)
    for name in ("results", ".snakemake"):
        shutil.copytree(whole.folder / name, folder / name, dirs_exist_ok=True)
    return project


def begin(project: Project, *arguments: str, **streams) -> subprocess.Popen:
    """Snakemake with its jobs in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "snakemake", *SMOKE, *arguments],
        cwd=project.folder,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
        stdin=subprocess.DEVNULL,
        start_new_session=True,
        **{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | streams,
    )


def locked(project: Project) -> bool:
    """Whether a run of Snakemake has begun that has not ended."""
    return any((project.folder / ".snakemake/locks").glob("*"))


def end(process: subprocess.Popen, number: signal.Signals) -> None:
    """Send a signal to a whole process group."""
    os.killpg(process.pid, number)
