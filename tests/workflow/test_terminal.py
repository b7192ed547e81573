"""What a terminal shows of a run: a line with the time to go, and last the reason of a failure."""

import errno
import fcntl
import os
import pty
import re
import signal
import subprocess
import sys
import time

import pytest

from tests.workflow.conftest import Project
from workflow.stops import sentence
from workflow.terminal import Job, Run, duration, last_line, progress_of


def on_a_terminal(project: Project, *arguments: str) -> list[str]:
    """Lines that a terminal is left with, each as its last overwriting has it."""
    main, terminal = pty.openpty()
    run = subprocess.Popen(
        [sys.executable, "-m", "snakemake", *arguments],
        cwd=project.folder,
        stdin=subprocess.DEVNULL,
        stdout=terminal,
        stderr=terminal,
    )
    os.close(terminal)
    shown = b""
    while True:
        try:
            shown += os.read(main, 65536)
        except OSError:  # the other end is closed
            break
    run.wait()
    os.close(main)
    text = re.sub(r"\x1b\[\d*m", "", shown.decode())
    return [line.split("\x1b[K")[-1] for line in text.replace("\r\n", "\n").splitlines()]


def test_a_run_leaves_a_line_of_its_jobs_and_a_failure_its_reason_last(project):
    table = "x1,y1,z1,x2,y2,z2,x3,y3,z3,force_x,force_y,force_z\n"
    table += "".join(f"1.{row},2,3,4,5,6,7,8,9,1,2,inf\n" for row in range(100, 200))
    (project.folder / "own.csv").write_text(table)
    arguments = ("--configfile", "config/smoke.yaml", "--config", "dataset={file: own.csv}", "--")
    lines = on_a_terminal(project, *arguments, "results/config.yaml")
    assert "1 of 1 jobs done" in lines
    assert len(lines) < 12
    lines = on_a_terminal(project, *arguments, "results/dataset/forces.h5")
    assert lines[-1].startswith("Stopped: own_data: own.csv: force of scene 0")
    assert "\x1b" not in lines[-1]
    assert len(lines) < 20


def test_beside_a_run_no_other_begins_not_even_one_of_other_files(project):
    (project.folder / ".snakemake").mkdir()
    with open(project.folder / ".snakemake/dustfall.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        (project.folder / ".snakemake/scripts").mkdir()
        (project.folder / ".snakemake/scripts/tmp1.settle.py").touch()
        done = project.snakemake("--", "verify")
        assert done.returncode == 1
        last = (done.stdout + done.stderr).rstrip().splitlines()[-1]
        assert last.startswith("Stopped: another run is at work in this folder")
        assert last.endswith("To go on: snakemake -- verify")
        # What the other run is at work with is as it was.
        assert (project.folder / ".snakemake/scripts/tmp1.settle.py").exists()
        project.dry_run("--", "results/config.yaml")
    project.run("--", "verify")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_while_snakemake_plans_is_told_in_a_sentence(project, number):
    run = subprocess.Popen(
        [sys.executable, "-m", "snakemake", "-n", "--", "all"],
        cwd=project.folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        # What runs the tests in the background may ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert run.stdout
    shown = []
    for line in run.stdout:
        shown.append(line)
        if line.startswith("Building DAG"):
            time.sleep(0.2)  # Snakemake passes over an interrupt of its words
            run.send_signal(number)
    run.stdout.close()
    assert run.wait() != 0
    assert shown[-1] == f"Stopped: ended by {number.name}. To go on: snakemake -n -- all\n"
    assert not any("Traceback" in line for line in shown)


def run_of(seconds: float, jobs: int, cores: int) -> Run:
    """A run of equal jobs, of which as many as there are cores are done and as many begun."""
    run = Run()
    run.waiting["settle"] = jobs
    for number in range(2 * cores):
        run.start(number, Job("settle", f"settle {number}", [], since=0.0))
    for number in range(cores):
        run.finish(number, now=seconds)
    for job in run.running.values():
        job.since = seconds
    return run


@pytest.mark.parametrize("cores", [1, 2, 5])
def test_the_time_to_go_of_equal_jobs_is_what_they_take(cores):
    run = run_of(seconds=30.0, jobs=10 * cores, cores=cores)
    assert run.seconds_to_go(now=30.0) == pytest.approx(9 * 30.0)
    assert run.seconds_to_go(now=45.0) == pytest.approx(8.5 * 30.0)
    assert run.total == 10 * cores


def test_little_work_done_tells_no_time():
    run = run_of(seconds=1.0, jobs=1000, cores=1)
    assert run.seconds_to_go(now=1.0) is None


def test_a_job_that_is_tried_again_counts_once():
    run = run_of(seconds=1.0, jobs=4, cores=1)
    run.fail(1)
    assert (run.total, run.waiting["settle"], len(run.failed)) == (4, 3, 1)
    run.start(1, Job("settle", "settle 1", [], since=2.0))
    run.finish(1, now=3.0)
    assert (run.total, run.done, len(run.failed)) == (4, 2, 0)


@pytest.mark.parametrize(
    ("line", "share"),
    [
        ("n100: 5 of 20 steps, 3 a second, 5 s to go", 0.25),
        ("streamwise 10/10: 60 of 60 epochs, 9 a second, 0 s to go", 1.0),
        ("ValueError: 3 of them are missing", None),
        ("", None),
    ],
)
def test_the_share_of_a_job_is_read_from_the_end_of_its_log(tmp_path, line, share):
    log = tmp_path / "job.log"
    log.write_text(f"begun\n{line}\n")
    assert progress_of([str(log)]) == share


def test_a_log_that_is_not_there_says_nothing(tmp_path):
    assert last_line([]) == last_line([str(tmp_path / "none.log")]) == ""


def test_times_are_rounded_to_what_is_known():
    assert [duration(s) for s in (0, 44, 89, 3599, 4800)] == [
        "10 s", "40 s", "1 min", "1 h 0 min", "1 h 20 min",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "", "results/a.h5"), "results/a.h5: the disk is full"),
        # As safetensors has it.
        (RuntimeError("I/O error: No space left on device (os error 28)"), "the disk is full"),
        (
            RuntimeError("I/O error: Is a directory (os error 21)"),
            "I/O error: Is a directory (os error 21)",
        ),
        (MemoryError(), "the memory is used up"),
        (ValueError("one\nand two"), "one and two"),
        (KeyboardInterrupt(), "KeyboardInterrupt"),
    ],
)
def test_an_error_is_told_by_its_cause(error, words):
    assert sentence(error) == words
