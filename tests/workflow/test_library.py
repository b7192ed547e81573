"""A rule watches just those library files that its script runs."""

import ast

import pytest

from dustfall.forces import learned
from workflow.library import (
    LOADS_SHIPPED,
    ROOT,
    SHIPPED,
    WITHOUT_RESULTS,
    imports_in,
    library_files,
)

SCRIPTS = sorted((ROOT / "workflow/scripts").glob("*.py"))


def files_of(folder, code: str) -> list[str]:
    script = folder / "script.py"
    script.write_text(code)
    return library_files(script)


def test_imports_through_other_modules_count(tmp_path):
    files = files_of(tmp_path, "from dustfall.sedimentation.settle import settle")
    assert "dustfall/sedimentation/settle.py" in files
    assert "dustfall/sedimentation/state.py" in files
    assert "dustfall/training/fit.py" not in files
    assert "dustfall/stokes/elements/single_layer.py" not in files


@pytest.mark.parametrize(
    "code",
    [
        "import dustfall.analysis.voronoi",
        "from dustfall.analysis import voronoi",
        "from dustfall.analysis.voronoi import voronoi_volumes",
        "def late():\n    from dustfall.analysis.voronoi import voronoi_volumes",
    ],
)
def test_every_way_to_import_counts(tmp_path, code):
    files = files_of(tmp_path, code)
    assert {"dustfall/analysis/voronoi.py", "dustfall/analysis/settling.py"} <= set(files)
    assert "dustfall/analysis/spectra.py" not in files


def test_a_name_that_a_package_exports_brings_the_modules_of_the_package(tmp_path):
    files = files_of(tmp_path, "from dustfall.figures import save")
    assert {"dustfall/figures/__init__.py", "dustfall/figures/style.py"} <= set(files)


def test_a_package_that_looks_for_its_modules_brings_them_all(tmp_path):
    files = files_of(tmp_path, "from dustfall.forces.formulas import FORMULAS")
    formulas = (ROOT / "dustfall/forces/formulas").glob("*.py")
    assert {file.relative_to(ROOT).as_posix() for file in formulas} <= set(files)


def test_a_name_made_up_at_run_time_is_refused(tmp_path):
    with pytest.raises(ImportError, match=r"train_model from dustfall\.forces.*from its module"):
        files_of(tmp_path, "from dustfall.forces import train_model")


def test_the_model_that_ships_counts_where_it_is_loaded_and_nowhere_else(tmp_path):
    assert SHIPPED == learned.SHIPPED
    model = SHIPPED.relative_to(ROOT).as_posix()
    load = "from dustfall.forces.learned import load_model\nload_model({})"
    for name, code, watched in (
        ("shipped", load.format(""), True),
        ("other", load.format("'results/model/anchored.safetensors'"), False),
        ("through", "import dustfall.benchmarks.settling_cost", True),
    ):
        (tmp_path / name).mkdir()
        assert (model in files_of(tmp_path / name, code)) == watched, name
    watching = {script.stem for script in SCRIPTS if model in library_files(script)}
    assert watching == {"moving_spheres", "settling_benchmark", "openfoam_settling"}


def test_every_call_that_loads_the_model_that_ships_is_found():
    for file in [*ROOT.glob("dustfall/**/*.py"), *ROOT.glob("workflow/**/*.py")]:
        code = file.read_text(encoding="utf-8")
        calls = {
            ast.unparse(node)
            for node in ast.walk(ast.parse(code))
            if isinstance(node, ast.Call) and not (node.args or node.keywords)
        }
        names = {call.removesuffix("()").rsplit(".", 1)[-1] for call in calls}
        assert ("load_model" in names) == bool(LOADS_SHIPPED.search(code)), file


def imports_of_the_parser(code: str) -> set[tuple[str, tuple[str, ...]]]:
    found = set()
    for node in ast.walk(ast.parse(code)):
        names = [alias.name for alias in getattr(node, "names", []) if isinstance(alias, ast.alias)]
        if isinstance(node, ast.ImportFrom):
            found.add(("." * node.level + (node.module or ""), tuple(names)))
        elif isinstance(node, ast.Import):
            found |= {(name, ()) for name in names}
    return found


def test_imports_are_those_that_the_parser_finds():
    files = [*ROOT.glob("dustfall/**/*.py"), *ROOT.glob("workflow/**/*.py")]
    assert len(files) > 200
    for file in files:
        code = file.read_text(encoding="utf-8")
        assert {(a, tuple(b)) for a, b in imports_in(code)} == imports_of_the_parser(code), file


@pytest.mark.parametrize(
    "code",
    [
        "import a.b as c, d",
        "from . import a",
        "from ..a.b import c as d, e",
        "from a import (  # first (of two)\n    b,  # last\n    c as d,\n)",
        "if a:\n\timport b\n\tfrom c import d # all",
    ],
)
def test_imports_are_found_however_they_are_written(code):
    assert {(a, tuple(b)) for a, b in imports_in(code)} == imports_of_the_parser(code)


def test_other_packages_do_not_count(tmp_path):
    assert files_of(tmp_path, "import numpy\nfrom pathlib import Path\nimport joblog") == []


def modules_of_the_parser(file) -> set[str]:
    """Files of the library whose modules the file imports itself, by Python's parser."""
    found = set()
    for package, names in imports_of_the_parser(file.read_text(encoding="utf-8")):
        for module in (package, *(f"{package}.{name}" for name in names)):
            if module.split(".")[0] == "dustfall":
                place = ROOT.joinpath(*module.split("."))
                found |= {place.with_suffix(".py"), place / "__init__.py"}
    return {path.relative_to(ROOT).as_posix() for path in found if path.is_file()}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_watches_what_it_imports_but_for_what_no_result_depends_on(script):
    # Of a package from which names of modules alone are taken, its __init__ says nothing.
    own = {file for file in modules_of_the_parser(script) if not file.endswith("__init__.py")}
    assert own - set(library_files(script)) == own & WITHOUT_RESULTS


def test_what_no_result_depends_on_is_there_and_imported():
    imported = set().union(*map(modules_of_the_parser, ROOT.glob("dustfall/**/*.py")))
    assert imported >= WITHOUT_RESULTS
