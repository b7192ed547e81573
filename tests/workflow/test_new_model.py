"""A closed formula added as one file is a force model everywhere, and disturbs nothing else."""

import re

import pytest

from tests.workflow.conftest import ROOT, Project

SMOKE = ("--configfile", "config/smoke.yaml")


def add_documented_formula(project: Project) -> str:
    """Put the formula of docs/extend.md into the project; return its name."""
    page = (ROOT / "docs/extend.md").read_text(encoding="utf-8")
    code = next(
        block for block in re.findall(r"```python\n(.*?)```", page, re.S) if "MODEL" in block
    )
    assert len(code.splitlines()) <= 20
    (project.folder / "dustfall/forces/formulas/screened.py").write_text(code)
    return "screened"


def test_its_name_is_allowed_and_its_cases_are_planned(project):
    name = add_documented_formula(project)
    words = project.dry_run("--config", f"sedimentation={{model: {name}}}", "--", "all")
    assert f"n1000_phi1e-03_ga1_seed3_{name}.nc" not in words  # it is the campaign's own model
    words = project.dry_run("--", "all")
    assert f"results/sedimentation/n1000_phi1e-03_ga1_seed3_{name}.nc" in words


def test_it_reruns_what_compares_models_and_no_training(rehearsal):
    before = rehearsal.plan(*SMOKE, "--", "all")
    assert before == {}
    try:
        add_documented_formula(rehearsal)
        jobs = rehearsal.plan(*SMOKE, "--config", "sedimentation={models: [formulas]}", "--", "all")
    finally:
        (rehearsal.folder / "dustfall/forces/formulas/screened.py").unlink()
    assert "evaluation" in jobs
    assert not {"stokes", "dataset", "sweep", "model", "trial"} & set(jobs)
    # The new formula and two that the smoke campaign leaves out, at three volume fractions.
    assert jobs["sedimentation"] == 3 * 3


@pytest.mark.slow
def test_it_appears_in_tables_and_figures(campaign):
    name = add_documented_formula(campaign)
    try:
        campaign.run(
            *SMOKE, "--config", f"sedimentation={{models: [{name}]}}", "--",
            "results/model/evaluation.csv", "results/figures/error_by_distance.csv",
            "results/figures/inverse_beta.csv", "results/analysis/steady_state.csv",
        )  # fmt: skip
    finally:
        (campaign.folder / "dustfall/forces/formulas/screened.py").unlink()
    results = campaign.folder / "results"
    assert f"\n{name}," in (results / "model/evaluation.csv").read_text()
    assert f"\n{name}," in (results / "analysis/steady_state.csv").read_text()
    for figure in ("error_by_distance", "inverse_beta"):
        assert re.search("screened", (results / f"figures/{figure}.csv").read_text()), figure
