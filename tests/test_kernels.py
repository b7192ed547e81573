"""Compiled kernels are kept, and found again, where neither the package nor HOME can be written."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "dustfall"

CODE = """
import os
{before}
from dustfall.forces.frames import sort_by_distance
import numpy as np
sort_by_distance(np.ones((1, 2, 3)))
print(os.environ["NUMBA_CACHE_DIR"], sum(sort_by_distance.stats.cache_hits.values()))
"""


@pytest.fixture
def environment(tmp_path):
    """Neither folder that numba would choose can be made, not even by root."""
    ignore = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PACKAGE, tmp_path / "site" / "dustfall", ignore=ignore)
    for folder in (tmp_path / "site").rglob("*/"):
        (folder / "__pycache__").touch()
    (tmp_path / "temporary").mkdir()
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CACHE")}
    return kept | {
        "HOME": os.devnull,
        "XDG_CACHE_HOME": "",
        "PYTHONPATH": str(tmp_path / "site"),
        "PYTHONDONTWRITEBYTECODE": "1",
        "TMPDIR": str(tmp_path / "temporary"),
    }


def cache_and_hits(environment, before="") -> tuple[Path, int]:
    done = subprocess.run(
        [sys.executable, "-P", "-c", CODE.format(before=before)],
        env=environment, cwd=environment["TMPDIR"], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    folder, hits = done.stdout.split()
    return Path(folder), int(hits)


def test_kernels_are_compiled_once_for_all_processes(environment):
    folder, hits = cache_and_hits(environment)
    assert folder.parent == Path(environment["TMPDIR"])
    assert folder.stat().st_mode & 0o777 == 0o700
    assert hits == 0
    assert cache_and_hits(environment) == (folder, 1)
    assert cache_and_hits(environment, before="import numba") == (folder, 1)


@pytest.mark.parametrize("plant", ["folder", "link"])
def test_a_cache_that_others_could_fill_is_not_read(environment, plant):
    own, _ = cache_and_hits(environment)
    moved = own.rename(own.with_name("theirs"))
    if plant == "folder":
        moved.rename(own).chmod(0o777)
    else:
        own.symlink_to(moved)
    folder, hits = cache_and_hits(environment)
    assert folder != own
    assert hits == 0


def test_a_cache_that_the_user_names_is_used(environment, tmp_path):
    named = tmp_path / "named"
    assert cache_and_hits(environment | {"NUMBA_CACHE_DIR": str(named)}) == (named, 0)
