"""Snakemake on a copy of the project, so that tests can run, edit and break it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


class Project:
    """A copy of the workflow and the library, with Snakemake to run on it.

    A copy that is in the folder already is taken as it is.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        if not (folder / "Snakefile").exists():
            self._copy()
        self.rules: set[str] = set()

    def _copy(self) -> None:
        for name in ("config", "docs", "profiles", "workflow"):
            shutil.copytree(ROOT / name, self.folder / name)
        shutil.copytree(
            ROOT / "dustfall",
            self.folder / "dustfall",
            ignore=shutil.ignore_patterns("__pycache__"),
        )
        self._share_kernels()
        shutil.copy2(ROOT / "Snakefile", self.folder)

    def _share_kernels(self) -> None:
        """Compile what numba compiles once, here or there: what a test edits is compiled anew."""
        for package in {source.parent for source in ROOT.glob("dustfall/**/*.py")}:
            cache = package / "__pycache__"
            cache.mkdir(exist_ok=True)
            (self.folder / cache.relative_to(ROOT)).symlink_to(cache)

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess:
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        return subprocess.run(
            [sys.executable, "-m", "snakemake", *arguments],
            cwd=self.folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
        )

    def run(self, *arguments: str) -> str:
        done = self.snakemake(*arguments)
        words = done.stdout + done.stderr
        assert done.returncode == 0, words
        return words

    def dry_run(self, *arguments: str) -> str:
        return self.run("--dry-run", *arguments)

    def plan(self, *arguments: str) -> dict[str, int]:
        """Jobs that a dry run announces, by rule; the target rule `all` is left out."""
        return jobs_of(self.dry_run(*arguments))

    def add_documented_formula(self) -> Path:
        """Put the force model of docs/extend.md where closed formulas lie; return its file."""
        page = (ROOT / "docs/extend.md").read_text(encoding="utf-8")
        blocks = re.findall(r"```python\n(.*?)```", page, re.S)
        code = next(block for block in blocks if "MODEL" in block)
        assert len(code.splitlines()) <= 20
        file = self.folder / "dustfall/forces/formulas/screened.py"
        file.write_text(code)
        return file


def jobs_of(words: str) -> dict[str, int]:
    """Jobs by rule, from the words of a dry run; the target rule `all` is left out."""
    if "Nothing to be done" in words:
        return {}
    table = words.split("Job stats:")[1].split("total")[0]
    jobs = {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", table, re.M)}
    jobs.pop("all", None)
    return jobs


def files_of(words: str, kind: str) -> set[str]:
    """Files that the jobs of a dry run have as "input" or as "output"."""
    lines = re.findall(f"^    {kind}: (.*)$", words, re.M)
    return {name for line in lines for name in line.split(", ")}


@pytest.fixture
def project(tmp_path) -> Project:
    return Project(tmp_path)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Project:
    """The smoke campaign, run from nothing to the last figure on two cores."""
    campaign = Project(tmp_path_factory.mktemp("campaign"))
    campaign.run("--configfile", "config/smoke.yaml", "--", "all")
    return campaign


@pytest.fixture(scope="module")
def rehearsal(tmp_path_factory) -> Project:
    """The smoke campaign as if it had run: every file is there and empty, and recorded as made."""
    rehearsal = Project(tmp_path_factory.mktemp("rehearsal"))
    arguments = ("--configfile", "config/smoke.yaml")
    words = rehearsal.dry_run(*arguments, "--", "all")
    for name in files_of(words, "output"):
        path = rehearsal.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    rehearsal.rules = set(jobs_of(words))
    rehearsal.run(*arguments, "--touch", "--forceall", "--", "all")
    return rehearsal
