"""The figure of OpenFOAM is made anew when its plugin, its case or the model's file changes."""

import os
import shutil

import pytest

from tests.workflow.conftest import ROOT, Project

COMMAND = ("--configfile", "config/smoke.yaml", "--", "results/figures/openfoam_settling.png")
WATCHED = [
    "cpp/dustfall/force_model.hpp",
    "openfoam/NeighbourDragForce.C",
    "openfoam/build.sh",
    "openfoam/foundation/Make/options",
    "openfoam/cases/make_settling.py",
    "openfoam/cases/settling/0/U",
    "openfoam/cases/settling/Allrun",
    "openfoam/cases/settling/system/controlDict",
    "dustfall/forces/export.py",
]


@pytest.fixture(scope="module")
def drawn(tmp_path_factory) -> Project:
    """A project with the plugin's sources, and the figure recorded as made."""
    project = Project(tmp_path_factory.mktemp("drawn"))
    for folder in ("cpp/dustfall", "openfoam"):
        ignored = shutil.ignore_patterns("build", "lnInclude", "linux*", "__pycache__")
        shutil.copytree(ROOT / folder, project.folder / folder, ignore=ignored)
    figures = project.folder / "results/figures"
    figures.mkdir(parents=True)
    for ending in ("png", "pdf", "csv"):
        (figures / f"openfoam_settling.{ending}").touch()
    project.run(*COMMAND[:-2], "--touch", "--forceall", *COMMAND[-2:])
    return project


@pytest.mark.parametrize("file", WATCHED)
def test_an_edited_source_draws_the_figure_anew(drawn, file):
    path = drawn.folder / file
    text = path.read_bytes()
    try:
        path.write_bytes(text + b"\n")
        assert drawn.plan(*COMMAND) == {"openfoam_settling": 1}
    finally:
        path.write_bytes(text)


def test_what_a_build_leaves_draws_nothing_anew(drawn):
    for product in ("openfoam/build/include-1/U", "openfoam/Make/linux64Gcc/NeighbourDragForce.o"):
        path = drawn.folder / product
        path.parent.mkdir(parents=True)
        path.touch()
    assert drawn.plan(*COMMAND) == {}


def test_a_plugin_older_than_its_sources_is_refused_with_a_sentence(drawn, monkeypatch):
    plugin = drawn.folder / "openfoam/build/libneighbourDrag.so"
    plugin.parent.mkdir(parents=True, exist_ok=True)
    plugin.touch()
    solver = drawn.folder / "bin/icoUncoupledKinematicParcelFoam"
    solver.parent.mkdir()
    solver.touch(0o755)
    monkeypatch.setenv("PATH", f"{solver.parent}{os.pathsep}{os.environ['PATH']}")
    source = drawn.folder / "openfoam/NeighbourDragForce.C"
    os.utime(source, (plugin.stat().st_mtime + 10,) * 2)
    done = drawn.snakemake("--cores", "1", "--force", *COMMAND)
    assert done.returncode == 1
    sentence = "openfoam/NeighbourDragForce.C is newer than the plugin; `make openfoam` builds it"
    assert sentence in done.stderr.splitlines()[-1]
