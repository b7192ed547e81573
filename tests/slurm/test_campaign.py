"""The smoke campaign on a cluster, killed on the way, leaves the bits of a local run."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.slurm.conftest import Cluster, wait_for
from tests.workflow.conftest import Project

SMOKE = ("--configfile", "config/smoke.yaml")
SLURM = ("--workflow-profile", "profiles/slurm")
HOUR = 3600.0


def submit(project: Project, cluster: Cluster, log: Path, *arguments: str) -> subprocess.Popen:
    """Snakemake with the shipped profile, in a session of its own, its words added to `log`."""
    with open(log, "a") as words:
        return subprocess.Popen(
            [sys.executable, "-m", "snakemake", *SLURM, *arguments],
            cwd=project.folder,
            env=cluster.environment,
            stdin=subprocess.DEVNULL,
            stdout=words,
            stderr=words,
            start_new_session=True,
        )


def snakemakes_words(project: Project) -> str:
    """What Snakemake has logged in this project until now."""
    return "".join(path.read_text() for path in project.folder.glob(".snakemake/log/*.log"))


def queue(cluster: Cluster, state: str) -> list[str]:
    """Numbers of the jobs in a state, a regular expression; those that are done have one too."""
    answer = cluster.ask("squeue", "--states=all", "--noheader", "--format=%i %T")
    return re.findall(rf"^(\S+) (?:{state})$", answer, re.M)


@pytest.fixture(scope="module")
def local(tmp_path_factory) -> tuple[Project, float]:
    """The smoke campaign on this machine, and its seconds."""
    project = Project(tmp_path_factory.mktemp("local"))
    begun = time.monotonic()
    project.run(*SMOKE, "--", "all")
    return project, time.monotonic() - begun


def test_a_campaign_killed_on_the_way_ends_with_the_bits_of_a_local_run(
    cluster, local, tmp_path_factory
):
    own, seconds = local
    project = Project(tmp_path_factory.mktemp("submitted"))
    log = project.folder / "snakemake.log"
    begun = time.monotonic()
    run = submit(project, cluster, log, *SMOKE, "--", "all")
    try:
        # A job of the cluster is killed: Snakemake submits it again.
        wait_for(lambda: queue(cluster, "RUNNING"), HOUR, "no job runs")
        killed = queue(cluster, "RUNNING")[0]
        cluster.ask("scancel", killed)
        wait_for(
            lambda: "Trying to restart" in snakemakes_words(project), HOUR, "no job is retried"
        )
        # Then Snakemake itself, in the midst of what follows the data set.
        data = project.folder / "results/dataset/forces.h5"
        wait_for(lambda: data.exists() and queue(cluster, "RUNNING"), HOUR, "there are no data")
    finally:
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
    cluster.ask("scancel", "--me")
    wait_for(lambda: not queue(cluster, "RUNNING|COMPLETING"), 120, "a job does not end")
    project.run("--unlock")
    run = submit(project, cluster, log, *SMOKE, "--", "all")
    assert run.wait() == 0, log.read_text()[-3000:]
    submitted = len(queue(cluster, r"\w+"))
    print(
        f"local {seconds:.0f} s; on the cluster {time.monotonic() - begun:.0f} s, {submitted} jobs"
    )
    assert differing_files(own.folder / "results", project.folder / "results") == []


def differing_files(one: Path, other: Path) -> list[str]:
    """Names of the files that only one of two folders has, or that differ in a bit."""
    found = [
        {
            path.relative_to(folder): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file()
        }
        for folder in (one, other)
    ]
    names = set().union(*found)
    return sorted(str(name) for name in names if found[0].get(name) != found[1].get(name))


def test_the_default_campaign_takes_fewer_than_twenty_submissions(cluster, tmp_path):
    project = Project(tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", *SLURM, "--dry-run", "--", "all"],
        cwd=project.folder,
        env=cluster.environment,
        capture_output=True,
        text=True,
    )
    words = done.stdout + done.stderr
    assert done.returncode == 0, words
    rules = "".join(path.read_text() for path in (project.folder / "workflow/rules").glob("*.smk"))
    rules += (project.folder / "Snakefile").read_text()
    bodies = re.findall(r"^rule (\w+):\n((?: .*\n|\n)*)", rules, re.M)
    local = [name for name, body in bodies if "localrule: True" in body]
    alone = set(re.findall(r"^rule (\w+):", words, re.M)) - {"all", *local}
    assert not alone
    assert words.count("Group job ") < 20
