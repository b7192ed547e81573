"""What README and docs tell one to run does run."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from dustfall.cli import parser
from tests.workflow.conftest import Project

ROOT = Path(__file__).resolve().parents[1]

PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [ROOT / "README.md", ROOT / "config/README.md", *sorted(ROOT.glob("docs/*.md"))]
}


WITHOUT_REFERENCE = {"analysis", "figures"}
"""Rooms that serve the campaign: tables and figures are described in its report."""


def parametrized(pattern: str):
    """Cases (text,) of all that a pattern finds in the pages, each named by page and line."""
    return [
        pytest.param(found[1], id=f"{page}:{text[: found.start()].count(chr(10)) + 1}")
        for page, text in PAGES.items()
        for found in re.finditer(pattern, text, re.M | re.S)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("code", parametrized(r"^```python\n(.*?)^```"))
def test_a_block_of_python_runs_by_itself(code, tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("command", parametrized(r"^    snakemake ([^\n#]*)"))
def test_a_call_of_snakemake_has_a_plan(command, tmp_path):
    Project(tmp_path).dry_run(*shlex.split(command))


@pytest.mark.parametrize("command", parametrized(r"^    make ([^\n#]*)"))
def test_a_call_of_make_has_its_target(command):
    target = shlex.split(command)[0]
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.M)


def test_make_run_takes_a_file_whose_path_has_spaces():
    # Of a dry run make still runs what makes the environment; it is taken for made.
    done = subprocess.run(
        ["make", "-n", "-o", "environment", "run", "CONFIG=my files/a config.yaml"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [shlex.split(line) for line in done.stdout.splitlines() if "yaml" in line]
    assert len(lines) == 2
    for words in lines:
        assert "my files/a config.yaml" in words


@pytest.mark.parametrize("command", parametrized(r"^    dustfall ([^\n#]*)"))
def test_a_call_of_dustfall_is_understood(command):
    arguments = shlex.split(command)
    assert parser().parse_args(arguments).subcommand == arguments[0]


def test_an_extra_that_the_readme_names_is_one():
    with open(ROOT / "pyproject.toml", "rb") as file:
        extras = tomllib.load(file)["project"]["optional-dependencies"]
    named = re.findall(r"^\| `(\w+)` \|.*\|.*\|$", PAGES["README.md"].split("| extra |")[1], re.M)
    assert {"files", "all"} <= set(named) <= set(extras)


def test_the_site_leaves_out_no_page_and_no_public_room():
    site, library = ((ROOT / name).read_text() for name in ("mkdocs.yml", "docs/api.md"))
    assert all(f" {path.name}\n" in site for path in ROOT.glob("docs/*.md"))
    rooms = [
        path.parent for path in ROOT.glob("dustfall/*/__init__.py") if "__all__" in path.read_text()
    ]
    for room in rooms:
        assert room.name in WITHOUT_REFERENCE or f"::: dustfall.{room.name}\n" in library
