"""The numbers of the docs come from the tables beside them, and these from a campaign."""

import json
import re
import shutil
from pathlib import Path

import jinja2
import pandas as pd
import pytest
import yaml

from dustfall.benchmarks.solver import MULTIPOLE
from tests.workflow.conftest import files_of
from workflow import validation
from workflow.pages import Written, markdown_table, read_tables, render, wide

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
TEMPLATE = DOCS / "validation.md.jinja"
TABLES = DOCS / "validation"
PAGE = (DOCS / "validation.md").read_text(encoding="utf-8")

EMPTY = {
    # Nearest neighbours multiply by no mobility.
    "all_particles/settling_cost.csv": {
        "products_nearest_neighbours_1",
        "products_nearest_neighbours_2",
    },
}
"""Columns of the tables of the docs that have no values, of a table that has any such."""

SOLVER = pd.DataFrame(
    [
        ("phi from 1e-8", MULTIPOLE, "tolerance 1e-2", 50, 0.4, 1e-5, 1e-3, 1.0, 3.0),
        ("phi from 1e-4", MULTIPOLE, "tolerance 1e-2", 50, 0.9, 3e-4, 2e-3, 0.98, 8.0),
        ("near contact", MULTIPOLE, "tolerance 1e-2", 50, 2.2, 2e-4, 4e-3, 1.0, 19.0),
        ("phi from 1e-8", "peer", None, 2, 0.3, 1e-3, 5e-2, None, None),
        ("phi from 1e-4", "peer", None, 2, 0.3, 2e-3, 6e-2, None, None),
        ("near contact", "peer", None, 2, 0.5, 3e-3, 7e-2, None, None),
    ],
    columns=[
        "set", "method", "setting", "scenes", "milliseconds",
        "error_median", "error_max", "covered", "estimate_over_error",
    ],
)  # fmt: skip

STRESS = pd.DataFrame(
    [
        ("gap", "pair", 0.1, 1e-4, 0.002, 1e-6, 2e-5, "converged"),
        ("gap", "pair", 1e-4, 1e-4, 0.120, 9e-4, 6e-6, "out of reach"),
        ("distance", "pair", 10.0, 1e-4, 0.001, 1e-5, 2e-5, "converged"),
        ("distance", "pair", 100.0, 1e-4, 0.001, 3e-9, 2e-5, "converged"),
        ("invariance", "moved [d_p]", 1e3, 1e-4, None, 1e-8, None, None),
        ("invariance", "turned", None, 1e-4, None, 2e-7, None, None),
        ("invariance", "distances alike", 1e-12, 1e-4, None, 3e-7, None, None),
        ("condition, one body", "50 elements", 1.0, None, None, None, None, None),
    ],
    columns=["test", "case", "value", "tolerance", "seconds", "error", "estimate", "status"],
)

CROWDS = pd.DataFrame(
    [
        ("crowd", "pair", 0, 0.02, 1e-4, 4e-5, 8e-5, "converged", 2e-9, 4e-9),
        ("crowd", "pair", 0, 0.02, 1e-8, 3e-8, 4e-8, "out of reach", None, None),
        ("crowd", "pair", 1, 0.10, 1e-4, 2e-5, 8e-5, "converged", None, None),
        ("crowd", "lattice", 0, 1.0, 1e-4, 5e-5, 6e-5, "converged", None, None),
    ],
    columns=[
        "test", "case", "scene", "value", "tolerance", "error", "estimate", "status", "difference",
        "peer_estimate",
    ],
)  # fmt: skip


@pytest.fixture
def benchmarked(tmp_path) -> Path:
    """A folder as a campaign leaves it that ran the benchmark of the solver alone."""
    for file, table in {"solver": SOLVER, "stress": pd.concat([STRESS, CROWDS])}.items():
        path = tmp_path / f"results/benchmarks/{file}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        table.to_csv(path, index=False)
    shutil.copyfile(TABLES / "config.yaml", tmp_path / validation.CONFIGURATION)
    for path, seconds in {"stokes/ball-0000": 2.0, "stokes/ball-0001": 3.5, "dataset": 0.5}.items():
        place = tmp_path / f"benchmarks/{path}.tsv"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(f"s\tmax_rss\tcpu_time\n9.0\t{100 * seconds}\t{seconds}\n")
    return tmp_path


FOUND = validation.Provenance("abc", "2026-01-01", "a processor", 2, {"numpy": "2"}, "config")


@pytest.mark.parametrize("name", validation.PAGES)
def test_a_page_is_what_its_tables_make(name):
    page = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    assert validation.page(DOCS / f"{name}.md.jinja", DOCS / name) == page


@pytest.mark.parametrize("table", sorted(path.name for path in TABLES.glob("*.csv")))
def test_every_row_of_a_table_shows_in_the_page(table, tmp_path):
    for path in TABLES.iterdir():
        shutil.copyfile(path, tmp_path / path.name)
    head, *rows = (TABLES / table).read_text(encoding="utf-8").splitlines(keepends=True)
    for left_out, row in enumerate(rows):
        # Without its only row a table would be gone: that row is another instead.
        rest = [*rows[:left_out], *rows[left_out + 1 :]] or [re.sub(r"\d", changed_digit, row)]
        (tmp_path / table).write_text("".join([head, *rest]), encoding="utf-8")
        assert validation.page(TEMPLATE, tmp_path) != PAGE, row


def changed_digit(digit: re.Match) -> str:
    return str(9 - int(digit[0]))


@pytest.mark.parametrize(
    "table",
    [
        f"{page}/{path.name}"
        for page in validation.PAGES
        for path in sorted((DOCS / page).glob("*.csv"))
    ],
)
def test_no_column_of_a_table_is_empty_but_those_that_count_what_there_is_none_of(table):
    found = pd.read_csv(DOCS / table)
    assert set(found.columns[found.isna().all()]) == EMPTY.get(table, set())


def test_the_page_tells_code_day_machine_and_configuration():
    head = PAGE.split("## ")[0]
    found = json.loads((TABLES / "provenance.json").read_text(encoding="utf-8"))
    versions = [f"{name} {number}" for name, number in found.pop("versions").items()]
    for value in [*found.values(), *versions]:
        assert str(value) in head
    config = yaml.safe_load((TABLES / "config.yaml").read_text(encoding="utf-8"))
    assert f"seed {config['seed']}" in head


def test_no_number_of_the_page_is_written_by_hand():
    text = TEMPLATE.read_text(encoding="utf-8")
    assert not re.search(r"^ *\|", text, re.M), "a table by hand"
    prose = re.sub(r"{#.*?#}|{{.*?}}|{%.*?%}|`[^`]*`|\]\([^)]*\)", "", text, flags=re.S)
    # Names of quantities, years of references and the level of all intervals are no results.
    prose = re.sub(r"1/beta|1/r|R\^2|\((19|20)\d\d\)|95 %", "", prose)
    assert not re.findall(r".*\d.*", prose)


def test_every_picture_that_the_docs_show_is_there_and_comes_from_a_campaign():
    shown = {
        (page.parent / target).resolve()
        for page in [ROOT / "README.md", *DOCS.glob("*.md")]
        for target in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page.read_text(encoding="utf-8"))
    }
    shown |= {
        DOCS / "pictures" / f"{name}.png"
        for name in re.findall(r'picture\("(\w+)"', TEMPLATE.read_text(encoding="utf-8"))
    }
    # The structure is that of the code, and other programs made the others, or a run of theirs.
    others = {"structure.png", "gmsh.png", "tools.png", "openfoam_settling.png"}
    assert {path.name for path in shown} == {*validation.PICTURES, *others}
    assert [path for path in shown if not path.is_file()] == []


def test_all_that_the_page_is_made_from_is_made_by_the_campaign_or_named_by_its_rule(project):
    words = project.dry_run("--", "all")
    made = {
        file.strip() for line in re.findall("^    output: (.*)$", words, re.M)
        for file in line.split(",")
    }  # fmt: skip
    rule = (ROOT / "workflow/rules/validation.smk").read_text(encoding="utf-8")
    further = set(re.findall(r'"(results/[^"]*)"', rule))
    pages = validation.PAGES.values()
    needed = {path for page in pages for _, sources in page.values() for path in sources}
    assert {path for path in needed if path.startswith("results/")} - made == further
    # A picture comes with the numbers that it draws.
    beside = {str(Path(path).with_suffix(".csv")) for path in validation.PICTURES.values()}
    assert {Path(path).stem for path in beside - made} <= {Path(path).stem for path in [
        *further, "settling_cloud.gif"]}  # fmt: skip


def test_the_page_is_no_part_of_all_and_needs_all_of_it(project):
    whole = project.plan("--", "all")
    page = project.plan("--", "validation")
    assert page == whole | {"validation": 1}


def test_the_rule_has_the_template_of_every_page_and_no_other(project):
    words = project.dry_run("--configfile", "config/smoke.yaml", "--", "validation")
    named = {Path(name).name for name in files_of(words, "input") if name.endswith(".jinja")}
    assert named == {f"{name}.md.jinja" for name in validation.PAGES}


def test_readme_leaves_measured_numbers_to_the_page():
    section = (ROOT / "README.md").read_text(encoding="utf-8").split("## How long, how accurate")[1]
    prose = re.sub(r"`[^`]*`|\]\([^)]*\)", "", section.split("\n## ")[0])
    assert "docs/validation.md" in section
    assert not re.search(r"\d", prose)


def test_a_table_without_its_source_is_left_out_and_a_former_one_removed(benchmarked, tmp_path):
    target = tmp_path / "tables"
    target.mkdir()
    (target / "scores.csv").write_text("of another campaign\n")
    validation.collect(benchmarked, target, FOUND)
    names = {path.stem for path in target.glob("*.csv")}
    assert names == {
        "pairs",
        "random_scenes",
        "methods",
        "strain",
        "crowds",
        "run_times",
        "oseen",
    }


@pytest.mark.parametrize("lost", ["results/benchmarks/stress.csv", validation.CONFIGURATION])
def test_what_cannot_be_reduced_leaves_all_tables_as_they_are(benchmarked, tmp_path, lost):
    target = tmp_path / "tables"
    validation.collect(benchmarked, target, FOUND)
    before = {path.name: path.read_bytes() for path in target.iterdir()}
    (benchmarked / "results/benchmarks/solver.csv").unlink()
    path = benchmarked / lost
    # A summary of another kind of campaign has other columns.
    path.write_text("column\n1\n") if path.suffix == ".csv" else path.unlink()
    with pytest.raises((KeyError, FileNotFoundError)):
        validation.collect(benchmarked, target, FOUND)
    assert {path.name: path.read_bytes() for path in target.iterdir()} == before


def test_what_is_left_out_is_said_in_its_place(benchmarked, tmp_path):
    validation.collect(benchmarked, tmp_path / "tables", FOUND)
    text = validation.page(TEMPLATE, tmp_path / "tables")
    for part in ("## Data set", "**Sweep**", "**Step size.**", "**Cost of a prediction.**"):
        after = text.split(part)[1].split("\n\n**")[0].split("\n\n## ")[0]
        assert re.search(r"^(\*\*)?.*\*Not measured in this campaign", after, re.M), part
        assert not re.search(r"^\|", after, re.M), part


def test_collecting_twice_gives_the_same_bytes(benchmarked, tmp_path):
    for folder in ("one", "two"):
        validation.collect(benchmarked, tmp_path / folder, FOUND)
    one, two = (
        {path.name: path.read_bytes() for path in (tmp_path / folder).iterdir()}
        for folder in ("one", "two")
    )
    assert one == two


def test_reduced_tables_keep_the_worst_of_what_they_reduce():
    row = validation.random_scenes(SOLVER).iloc[0]
    assert (row["error_max"], row["covered"], row["scenes"]) == (4e-3, 0.98, 150)
    assert (row["fastest"], row["slowest"]) == (0.4, 2.2)
    strained = validation.strain(pd.concat([STRESS, CROWDS]))
    assert len(strained) == 1
    row = strained.iloc[0]
    assert (row["clusters"], row["converged"], row["smallest_gap"]) == (2, 1, 0.1)
    # What is out of reach has no part in the error of the converged, but in what is covered.
    assert (row["error_max"], row["covered"]) == (1e-6, 0.5)
    assert row[["apart", "moved", "turned", "alike"]].tolist() == [1e-5, 1e-8, 2e-7, 3e-7]


def test_a_training_is_shown_at_powers_and_at_its_end_with_the_best_until_then():
    rows = [
        ("streamwise", 100, 3.0), ("streamwise", 200, 4.0), ("streamwise", 300, 1.0),
        ("lateral", 100, 0.5), ("lateral", 200, 0.4),
    ]  # fmt: skip
    history = pd.DataFrame(rows, columns=["component", "epoch", "validation_error"])
    history["r2"] = history["component"].map({"streamwise": 0.9, "lateral": 0.8})
    table = validation.paper_training(history).set_index("epoch")
    assert table.index.tolist() == [100, 300]
    assert table["streamwise_best"].tolist() == [3.0, 1.0]
    # A component that stopped earlier keeps its best.
    assert table["lateral_best"].tolist() == [0.5, 0.4]
    assert table.loc[300, ["streamwise_r2", "lateral_r2"]].tolist() == [0.9, 0.8]


def test_crowds_keep_the_worst_of_each_family():
    pair, lattice = validation.crowds(CROWDS).to_dict("records")
    assert (pair["scenes"], pair["solves"], pair["converged"]) == (2, 3, 2)
    assert (pair["smallest_gap"], pair["compared"], lattice["compared"]) == (0.02, 1, 0)
    # What is out of reach may miss its tolerance, but not its estimate.
    assert pair["over_tolerance"] == pytest.approx(0.4)
    assert pair["over_estimate"] == pytest.approx(0.75)
    assert (pair["difference"], pair["peer_estimate"]) == (2e-9, 4e-9)


def test_methods_stand_side_by_side_in_the_two_hardest_sets():
    table = validation.methods(SOLVER).set_index("method")
    assert table.loc["peer", ["dense_error", "contact_error"]].tolist() == [6e-2, 7e-2]
    assert table["dense_milliseconds"].tolist() == [0.9, 0.3]


def test_run_times_are_sums_over_the_jobs_of_a_stage(benchmarked):
    table = validation.run_times(benchmarked / "benchmarks").set_index("stage")
    assert table["core_seconds"].to_dict() == {"stokes": 5.5, "dataset": 0.5}
    assert table["jobs"].to_dict() == {"stokes": 2, "dataset": 1}
    assert table.loc["stokes", "memory"] == 350


@pytest.mark.parametrize("value", [1e-4, 2.5e-8, 0.1, 1.0, 1000.0])
def test_a_power_is_written_with_all_its_digits(value):
    assert float(Written().format_field(value, "power")) == value


@pytest.mark.parametrize("value", [0.0, 3.14159e-12, -3.14159e-5, 0.0314159, 0.314159, 31.4159])
def test_an_error_is_written_to_two_digits(value):
    assert float(Written().format_field(value, "error")) == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize("rest", [1e-12, 3.2e-9, 4.2e-5, 9.9e-4])
def test_a_score_near_one_keeps_what_is_missing_to_one(rest):
    one, minus = Written().format_field(1 - rest, "near_one").split(" - ")
    assert (one, float(minus)) == ("1", pytest.approx(rest, rel=0.05))


@pytest.mark.parametrize("value", [1.0, 0.998, 0.0, -1.5448])
def test_another_score_has_four_decimals(value):
    assert Written().format_field(value, "near_one") == f"{value:.4f}"


@pytest.mark.parametrize(
    ("value", "short"), [(123_876.0, "120,000"), (433.0, "430"), (9.46, "9.5"), (0.0831, "0.083")]
)
def test_a_time_is_written_short(value, short):
    assert Written().format("{:short}", value) == short


def test_a_cell_falls_back_where_a_value_is_missing():
    table = pd.DataFrame({"value": [1.0, None], "half": [0.1, None], "end": [2.0, 3.0]})
    columns = {"a": ["{value:.0f} ± {half:.1f}", "at the end {end:.0f}"], "b": "{value:.1f}"}
    assert markdown_table(table, columns).splitlines()[2:] == [
        "| 1 ± 0.1 | 1.0 |",
        "| at the end 3 |  |",
    ]


def test_a_bar_in_a_cell_does_not_end_it():
    assert r"a \| b" in markdown_table(pd.DataFrame({"x": ["a | b"]}), {"": "{x}"})


def test_a_wide_table_has_each_number_where_row_and_column_meet():
    long = pd.DataFrame({"phi": [0.1, 0.1, 0.001], "n": [9, 20, 9], "v": [1.0, 2.0, 3.0]})
    table = wide(long, "phi", "n")
    assert table["phi"].tolist() == [0.1, 0.001]
    assert table["v_9"].tolist() == [1.0, 3.0]
    assert table["v_20"].isna().tolist() == [False, True]
    with pytest.raises(ValueError, match="duplicate"):
        wide(pd.concat([long, long]), "phi", "n")


def test_a_table_without_rows_or_with_an_unknown_column_is_refused():
    with pytest.raises(ValueError, match="without rows"):
        markdown_table(pd.DataFrame({"x": []}), {"": "{x}"})
    with pytest.raises(KeyError, match="speed"):
        markdown_table(pd.DataFrame({"x": [1.0]}), {"": "{speed}"})


def test_a_name_that_nothing_gives_is_refused(tmp_path):
    (tmp_path / "page.md.jinja").write_text("{{ unheard_of }}")
    with pytest.raises(jinja2.UndefinedError, match="unheard_of"):
        render(tmp_path / "page.md.jinja", read_tables(tmp_path))
