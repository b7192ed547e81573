"""The smoke campaign through Snakemake: whole, and repeatable bit by bit."""

import shutil

import h5py
import numpy as np
import pytest

from tests.workflow.browser import look_at
from workflow import validation

pytestmark = pytest.mark.slow

SMOKE = ("--configfile", "config/smoke.yaml")


def test_every_figure_is_there_with_its_numbers(campaign):
    folder = campaign.folder / "results/figures"
    pictures = sorted(folder.glob("*.png"))
    assert len(pictures) == 23
    for picture in pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
        assert len(picture.with_suffix(".csv").read_text().splitlines()) > 1
    assert (folder / "settling_cloud.gif").read_bytes().startswith(b"GIF89a")


def test_a_second_run_has_nothing_to_do(campaign):
    assert campaign.plan(*SMOKE, "--", "all") == {}


def test_bits_of_the_data_depend_neither_on_cores_nor_on_shard_size(campaign, tmp_path):
    campaign.run(
        *SMOKE, "--cores", "1", "--directory", str(tmp_path), "--config",
        "scenes={shard_size: 17}", "--", "results/dataset/forces.h5",
    )  # fmt: skip
    one, other = (folder / "results/dataset/forces.h5" for folder in (campaign.folder, tmp_path))
    with h5py.File(one) as a, h5py.File(other) as b:
        assert set(a) == set(b)
        for name in a:
            np.testing.assert_array_equal(a[name][()], b[name][()], err_msg=name)
    assert one.read_bytes() == other.read_bytes()


def test_a_lost_result_is_made_again_with_the_same_bytes(campaign):
    figure = campaign.folder / "results/figures/voronoi_pdf.png"
    before = figure.read_bytes()
    figure.unlink()
    campaign.run(*SMOKE, "--", "all")
    assert figure.read_bytes() == before


@pytest.mark.browser
@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium here to open the report")
def test_every_figure_and_table_shows_in_the_report_which_leads_through_them(campaign, tmp_path):
    campaign.run(*SMOKE, "--report", "report.html", "--", "all")
    found = look_at(campaign.folder / "report.html", tmp_path)
    results = campaign.folder / "results"
    expected = [*results.glob("figures/*.png"), *results.glob("figures/*.gif")]
    expected += results.glob("tables/*.html")
    assert set(found["shown"]) == {str(path.relative_to(campaign.folder)) for path in expected}
    for path, shown in found["shown"].items():
        assert shown["size"] > (1 if path.endswith("html") else 300), path
        assert shown["labels"], path
        assert len(shown["caption"]) > 20, path
    assert found["folders"]
    for folder in found["folders"]:
        assert f"{folder}:" in found["front"]


def test_a_formula_added_as_one_file_appears_in_tables_and_figures(campaign):
    formula = campaign.add_documented_formula()
    name = formula.stem
    try:
        campaign.run(
            *SMOKE, "--config", f"sedimentation={{models: [{name}]}}", "--",
            "results/model/evaluation.csv", "results/figures/error_by_distance.csv",
            "results/figures/inverse_beta.csv", "results/analysis/steady_state.csv",
        )  # fmt: skip
    finally:
        formula.unlink()
    results = campaign.folder / "results"
    assert f"\n{name}," in (results / "model/evaluation.csv").read_text()
    assert f"\n{name}," in (results / "analysis/steady_state.csv").read_text()
    for figure in ("error_by_distance", "inverse_beta"):
        assert "screened" in (results / f"figures/{figure}.csv").read_text(), figure


def test_the_page_of_the_docs_is_written_from_it(campaign):
    campaign.run(*SMOKE, "--", "validation")
    docs, figures = campaign.folder / "docs", campaign.folder / "results/figures"
    page = (docs / "validation.md").read_text()
    assert "config/smoke.yaml" in page
    assert page == validation.page(docs / "validation.md.jinja", docs / "validation")
    for figure in ("inverse_beta.png", "settling_cloud.gif"):
        assert (docs / "pictures" / figure).read_bytes() == (figures / figure).read_bytes()
