"""What README and docs tell one to run does run."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.workflow.conftest import Project

ROOT = Path(__file__).resolve().parents[1]

PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [ROOT / "README.md", ROOT / "config/README.md", *sorted(ROOT.glob("docs/*.md"))]
}


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
