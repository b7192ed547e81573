"""What a terminal shows of a campaign: one line with the time to go.

Snakemake's own words, several lines for every job, go on into `.snakemake/log`.
"""

import atexit
import logging
import shutil
import sys
import threading
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

from snakemake.logging import logger
from snakemake_interface_logger_plugins.common import LogEvent

SECONDS = {
    "sweep": 83.0,
    "model": 28.0,
    "figure_frozen_cloud": 20.0,
    "audit": 70.0,
    "mesh_study": 40.0,
    "trial": 13.0,
    "all_particles": 12.0,
    "sedimentation": 9.0,
    "stokes": 4.0,
    "voronoi_cells": 3.0,
}
"""Core-seconds of a job in the campaign of docs/validation: they weigh the rules until this run has
jobs of its own to go by."""

ENOUGH = 0.03
"""Share of the work that has to be done before the time to go is told."""

OTHERS = 2.0
"""Core-seconds of a job of any other rule."""

EVERY = {True: 0.5, False: 60.0}
"""Seconds between two lines: on a terminal, where a line replaces the last, and in a file."""

HIDDEN = {
    LogEvent.JOB_INFO,
    LogEvent.JOB_STARTED,
    LogEvent.JOB_FINISHED,
    LogEvent.JOB_ERROR,
    LogEvent.GROUP_INFO,
    LogEvent.GROUP_ERROR,
    LogEvent.PROGRESS,
    LogEvent.RESOURCES_INFO,
    LogEvent.RULEGRAPH,
    LogEvent.RUN_INFO,
    LogEvent.SHELLCMD,
    LogEvent.WORKFLOW_STARTED,
}


@dataclass
class Job:
    """A job that runs: its rule, the log that its words go to, and since when [s]."""

    rule: str
    name: str
    logs: list[str]
    since: float


@dataclass
class Run:
    """What is known of a run: jobs to do by rule, those that run, and what finished ones took."""

    waiting: Counter = field(default_factory=Counter)
    running: dict[int, Job] = field(default_factory=dict)
    took: dict[str, list[float]] = field(default_factory=dict)
    failed: set[int] = field(default_factory=set)
    done: int = 0
    begun: float = 0.0

    @property
    def total(self) -> int:
        """Number of all jobs."""
        return self.done + len(self.running) + sum(self.waiting.values())

    def start(self, number: int, job: Job) -> None:
        """Note that a job has begun."""
        self.waiting[job.rule] -= 1
        self.running[number] = job
        self.failed.discard(number)

    def finish(self, number: int, now: float) -> None:
        """Note that a job is done."""
        if number in self.running:
            job = self.running.pop(number)
            self.took.setdefault(job.rule, []).append(now - job.since)
            self.done += 1

    def fail(self, number: int) -> None:
        """Note that a job has failed; it may be tried again."""
        job = self.running.pop(number, None)
        if job:
            self.waiting[job.rule] += 1
            self.failed.add(number)

    def seconds_to_go(self, now: float) -> float | None:
        """Seconds until the last job is done, as if as many jobs went on at a time as until now.

        None before enough is done to tell.
        """

        def weight(jobs: Mapping[str, int]) -> float:
            return sum(SECONDS.get(rule, OTHERS) * number for rule, number in jobs.items())

        done = {rule: len(took) for rule, took in self.took.items()}
        running = Counter(job.rule for job in self.running.values())
        if weight(done) < ENOUGH * (weight(done) + weight(running) + weight(self.waiting)):
            return None
        worked = sum(map(sum, self.took.values()))
        pace = worked / weight(done)

        def seconds(rule: str) -> float:
            took = self.took.get(rule)
            return sum(took) / len(took) if took else pace * SECONDS.get(rule, OTHERS)

        left = sum(seconds(rule) * number for rule, number in self.waiting.items())
        for job in self.running.values():
            left += max(seconds(job.rule) + job.since - now, 0)
            worked += now - job.since
        return left * (now - self.begun) / max(worked, now - self.begun)


class Terminal(logging.Handler):
    """Follows a run by the records that Snakemake logs, and writes the line."""

    def __init__(self, stream: TextIO):
        super().__init__()
        self.stream, self.live, self.run = stream, stream.isatty(), Run()
        self.written = ""
        self.begun, self.stopped = threading.Event(), threading.Event()

    def emit(self, record: logging.LogRecord) -> None:
        """Take in what a record tells of the run."""
        now = time.monotonic()
        match getattr(record, "event", None):
            case LogEvent.RUN_INFO if stats := getattr(record, "stats", None):
                self.run.waiting = Counter(
                    {rule: number for rule, number in stats.items() if rule not in ("total", "all")}
                )
                self.run.begun = now
                self.begun.set()
                threading.Thread(target=self._tick, daemon=True).start()
            case LogEvent.JOB_INFO:
                self._begin(record, now)
            case LogEvent.JOB_FINISHED:
                self.run.finish(record.job_id, now)  # type: ignore[attr-defined]
            case LogEvent.JOB_ERROR:
                self.run.fail(record.jobid)  # type: ignore[attr-defined]
            case LogEvent.GROUP_ERROR:
                for info in record.job_error_info:  # type: ignore[attr-defined]
                    self.run.fail(info["jobid"])
            case _:
                return
        self.show()

    def _begin(self, record, now: float) -> None:
        if record.rule_name != "all":
            wildcards = " ".join(map(str, record.wildcards.values())) if record.wildcards else ""
            name = f"{record.rule_name} {wildcards}".strip()
            self.run.start(record.jobid, Job(record.rule_name, name, list(record.log), now))

    def _tick(self) -> None:
        while not self.stopped.wait(EVERY[self.live]):
            self.show(due=True)

    def show(self, due: bool = False) -> None:
        """Write the line: in a file, at its times and for the last job."""
        ended = self.run.done == self.run.total
        if self.stopped.is_set() or not (self.live or due or ended):
            return
        # Under the lock that records come in by: what the line tells of does not change meanwhile.
        with self.lock:  # type: ignore[union-attr]
            line = self._line(time.monotonic())
            if line == self.written:
                return
            self.written = line
            if self.live:
                columns = shutil.get_terminal_size().columns - 1
                line = f"\r\x1b[K{line[:columns]}"
            self.stream.write(line if self.live and not ended else f"{line}\n")
            self.stream.flush()

    def _line(self, now: float) -> str:
        run = self.run
        line = f"{run.done} of {run.total} jobs"
        if run.done == run.total:
            return f"{line} done"
        seconds = run.seconds_to_go(now)
        if seconds is not None:
            line += f", about {duration(seconds)} to go"
        if run.failed:
            line += f", {len(run.failed)} failed"
        shown = [self._named(job) for job in list(run.running.values())[:4]]
        more = len(run.running) - len(shown)
        return (
            line + (": " + ", ".join(shown) if shown else "") + (f", {more} more" if more else "")
        )

    def _named(self, job: Job) -> str:
        share = progress_of(job.logs)
        return job.name if share is None else f"{job.name} {share:.0%}"

    def clear(self) -> None:
        """Make room for other words: the line comes again below them."""
        if self.live and self.written:
            with self.lock:  # type: ignore[union-attr]
                self.stream.write("\r\x1b[K")
                self.stream.flush()
                self.written = ""

    def stop(self) -> None:
        """End the line, so that what comes next has its own."""
        if not self.stopped.is_set():
            self.stopped.set()
            if self.live and self.written and self.run.done < self.run.total:
                self.stream.write("\n")
                self.stream.flush()


def duration(seconds: float) -> str:
    """Seconds in words, rounded: 40 s, 12 min, 1 h 20 min."""
    if seconds < 60:
        return f"{max(10 * round(seconds / 10), 10)} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def progress_of(logs: list[str]) -> float | None:
    """Share of a job that is done, by the last line of its log; None where that does not tell."""
    words = last_line(logs).rsplit(": ", 1)[-1].split()
    if len(words) > 2 and words[1] == "of" and words[0].isdigit() and words[2].isdigit():
        return int(words[0]) / max(int(words[2]), 1)
    return None


def last_line(logs: list[str]) -> str:
    """Last line of the first of some logs, as far as there is any."""
    try:
        with open(Path(logs[0]), "rb") as file:
            file.seek(max(file.seek(0, 2) - 4096, 0))
            lines = file.read().decode(errors="replace").strip().splitlines()
    except (IndexError, OSError):
        return ""
    return lines[-1].strip() if lines else ""


class _Quiet(logging.Filter):
    """Keeps what the line tells from Snakemake's own words on the terminal."""

    def __init__(self, terminal: Terminal):
        super().__init__()
        self.terminal = terminal

    def filter(self, record: logging.LogRecord) -> bool:
        begun = self.terminal.begun.is_set() and record.levelno < logging.WARNING
        if begun or getattr(record, "event", None) in HIDDEN:
            return False
        self.terminal.clear()
        return True


def follow(workflow) -> Terminal:
    """Show a run of jobs by one line in place of Snakemake's words.

    They stay as they are in a dry run, in the processes of single jobs, in a workflow of which this
    one is a module, and where --quiet, --verbose or a logger plugin says otherwise.
    """
    settings, terminal = workflow.output_settings, Terminal(sys.stderr)
    own_words = settings.dryrun or settings.quiet or settings.verbose
    handlers = [handler for handler in logger.handlers if handler.name == "DefaultStreamHandler"]
    own_run = workflow.is_main_process and workflow.modifier.is_main_snakefile()
    if own_run and handlers and not own_words:
        handlers[0].addFilter(_Quiet(terminal))
        logger.addHandler(terminal)
        atexit.register(terminal.stop)
    return terminal
