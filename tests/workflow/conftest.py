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
    """A copy of the workflow and the library, with Snakemake to run on it."""

    def __init__(self, folder: Path):
        self.folder = folder
        for name in ("config", "dustfall", "profiles", "workflow"):
            shutil.copytree(ROOT / name, folder / name)
        shutil.copy2(ROOT / "Snakefile", folder)

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

    def run(self, *arguments: str) -> None:
        done = self.snakemake(*arguments)
        assert done.returncode == 0, done.stdout + done.stderr

    def plan(self, *arguments: str) -> dict[str, int]:
        """Jobs that a dry run announces, by rule; the target rule `all` is left out."""
        done = self.snakemake("--dry-run", *arguments)
        assert done.returncode == 0, done.stdout + done.stderr
        words = done.stdout + done.stderr
        if "Nothing to be done" in words:
            return {}
        table = words.split("Job stats:")[1].split("total")[0]
        jobs = {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", table, re.M)}
        jobs.pop("all", None)
        return jobs


@pytest.fixture
def project(tmp_path) -> Project:
    return Project(tmp_path)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory) -> Project:
    """The smoke campaign, run from nothing to the last figure on two cores."""
    campaign = Project(tmp_path_factory.mktemp("campaign"))
    campaign.run("--configfile", "config/smoke.yaml", "--", "all")
    return campaign
