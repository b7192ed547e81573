"""A job's words go into its log, and nowhere else."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from workflow import checksums

SCRIPTS = Path(__file__).resolve().parents[2] / "workflow/scripts"


HEAD = f"""
import sys
sys.path[:0] = {[str(SCRIPTS), str(SCRIPTS.parents[1])]!r}
import joblog
from types import SimpleNamespace
log = sys.argv.pop(1)
job = SimpleNamespace(rule="some_rule", log=[log], input=sys.argv[1:2], output=sys.argv[2:3])
progress = joblog.start(job)
"""


def run(folder, code: str, reads="", writes="", log="job.log", **streams) -> tuple[int, str]:
    """Exit status and log of a job with this body, which reads and writes a file at most."""
    files = [reads, writes] if writes else [reads] if reads else []
    done = subprocess.run(
        [sys.executable, "-c", HEAD + code, log, *files], check=False, cwd=folder, **streams
    )
    return done.returncode, (folder / log).read_text()


def write(path: str) -> str:
    return f"open({path!r}, 'w').write('content')"


def test_all_that_is_printed_is_in_the_log_in_order(tmp_path):
    code = "import os\nprint('one')\nos.system('echo two')\nprint('three', file=sys.stderr)"
    assert run(tmp_path, code) == (0, "one\ntwo\nthree\n")


def test_an_uncaught_exception_is_in_the_log(tmp_path):
    status, log = run(tmp_path, "print('begun')\nraise RuntimeError('no convergence')")
    assert status == 1
    assert log.startswith("begun\nTraceback")
    assert log.endswith("RuntimeError: no convergence\n")


def test_progress_is_plain_lines_in_the_log_alone(tmp_path):
    with open(tmp_path / "stderr", "w+") as stderr:
        _, log = run(tmp_path, "progress('settle')(5, 5)", stderr=stderr)
        stderr.seek(0)
        assert stderr.read() == ""
    assert log.startswith("settle: 5 of 5 items")


TABLE, PICTURE = "results/a/table.csv", "results/picture.png"


def made(folder) -> None:
    """A folder whose table a job has made, from a file of the user's own."""
    (folder / "results/a").mkdir(parents=True)
    (folder / "own.txt").write_text("mine")
    assert run(folder, write(TABLE), "own.txt", TABLE)[0] == 0


def test_what_a_job_made_is_sealed_as_sha256sum_reads_it(tmp_path):
    made(tmp_path)
    seal = tmp_path / f"results/checksums/{TABLE.removeprefix('results/')}.sha256"
    subprocess.run(["sha256sum", "--check", "--status", seal], cwd=tmp_path, check=True)
    assert run(tmp_path, write(PICTURE), TABLE, PICTURE)[0] == 0


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "unsealed", "seal"])
def test_a_job_reads_nothing_that_is_not_what_its_job_wrote(tmp_path, damage):
    made(tmp_path)
    table, seal = tmp_path / TABLE, tmp_path / "results/checksums/a/table.csv.sha256"
    match damage:
        case "flip":
            table.write_text("contenu")
        case "cut" | "empty":
            os.truncate(table, 3 if damage == "cut" else 0)
        case "unsealed":
            seal.unlink()
        case "seal":
            seal.write_bytes(b"\xff" + seal.read_bytes())
    status, log = run(tmp_path, write(PICTURE), TABLE, PICTURE)
    assert status == 1
    assert log.splitlines()[-1].startswith(f"workflow.checksums.DamageError: {TABLE} ")
    assert f"rm '{TABLE}'" in log
    assert not (tmp_path / PICTURE).exists()
    (note,) = (tmp_path / "logs/stopped").read_text().splitlines()
    assert note.startswith(f"some_rule: {TABLE} ")


def test_what_a_failed_job_wrote_gets_no_checksum(tmp_path):
    (tmp_path / "results").mkdir()
    code = f"{write(PICTURE)}\nraise MemoryError"
    assert run(tmp_path, code, "", PICTURE)[0] == 1
    assert not list((tmp_path / "results").rglob("*.sha256"))
    assert (tmp_path / "logs/stopped").read_text() == "some_rule: the memory is used up\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_job_that_is_interrupted_leaves_one_sentence_and_no_file(tmp_path, number):
    (tmp_path / "results").mkdir()
    # In a compiled function, where Python's own handler ends in an error of numba's.
    code = f"""
from dustfall.files import atomic
import os, signal, threading
from numba import njit

@njit
def spin(n):
    x = 0.0
    for k in range(n):
        x += 1.0 / (k + 1.0)
    return x

spin(1)
with atomic({PICTURE!r}):
    threading.Timer(0.1, os.kill, (os.getpid(), signal.{number.name})).start()
    while True:
        spin(10**7)
"""
    status, log = run(tmp_path, code, "", PICTURE)
    assert status == 128 + number
    assert log == f"some_rule: ended by {number.name}\n"
    assert list((tmp_path / "results").iterdir()) == []


def test_every_file_of_a_campaign_is_verified(tmp_path, monkeypatch):
    made(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert dict(checksums.verify()) == {Path(TABLE): ""}
    Path(TABLE).write_text("contenu")
    Path("results/stray.csv").touch()
    Path("results/checksums/lost.csv.sha256").touch()
    words = {path.name: complaint for path, complaint in checksums.verify()}
    assert "is damaged" in words["table.csv"]
    assert "no checksum" in words["stray.csv"]
    assert "is lost" in words["lost.csv"]


def test_below_the_prefix_of_a_module_it_is_the_same(tmp_path, monkeypatch):
    for folder in ("dust/results", "dust/logs/figures", "elsewhere/results"):
        (tmp_path / folder).mkdir(parents=True)
    table, log = f"dust/{TABLE}", "dust/logs/figures/some_rule.log"
    (tmp_path / table).parent.mkdir()
    (tmp_path / "elsewhere/results/own.csv").write_text("mine")
    assert run(tmp_path, write(table), "elsewhere/results/own.csv", table, log)[0] == 0
    monkeypatch.chdir(tmp_path)
    assert dict(checksums.verify(checksums.results_of(log))) == {Path(table): ""}
    (tmp_path / table).write_text("contenu")
    status, words = run(tmp_path, write(f"dust/{PICTURE}"), table, f"dust/{PICTURE}", log)
    assert status == 1
    assert f"DamageError: {table} is damaged" in words
