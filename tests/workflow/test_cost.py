"""What a campaign is foretold to take is what a measured one took, and grows with its settings."""

import shutil
from pathlib import Path

import pandas as pd
import pytest
import yaml

from workflow.configuration import configure
from workflow.cost import Cost, CostError, check_jobs, check_plan, cost

DOCS = Path(__file__).resolve().parents[2] / "docs/validation"


def of(**settings):
    return cost(configure(settings))


def test_the_campaign_of_the_docs_took_what_is_foretold_within_a_factor_of_two():
    settings = yaml.safe_load((DOCS / "config.yaml").read_text())
    # Cases that a campaign before them did not have.
    settings["sedimentation"] = {"long": {"particles": []}, "back_flow": False} | settings[
        "sedimentation"
    ]
    bound = cost(configure(settings))
    measured = pd.read_csv(DOCS / "run_times.csv")
    assert 1 <= bound.seconds / measured["core_seconds"].sum() <= 2
    # Some jobs of a campaign are not timed.
    assert 1 <= bound.jobs / measured["jobs"].sum() <= 2
    assert 1 <= bound.memory / (1e6 * measured["memory"].max()) <= 2


def test_cost_grows_with_what_is_asked_for():
    usual = of()
    assert of(scenes={"number": {"ball": 10**9}}).disk > 1e12
    assert of(scenes={"number": {"ball": 10**12}, "shard_size": 1}).planning > 1e15
    assert of(sedimentation={"particles": [10**7]}).memory > 1e10
    longer = of(sedimentation={"duration": 1000})
    assert 5 < longer.disk / usual.disk < 10
    assert usual.seconds < longer.seconds < 10 * usual.seconds


def test_a_campaign_that_is_half_done_needs_half_the_room(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results/sedimentation").mkdir(parents=True)
    disk = shutil.disk_usage(tmp_path)
    bound = Cost(1, 1.0, disk=disk.total + 1e9, planning=1e6, memory=1e6)
    with pytest.raises(CostError, match="GB of disk"):
        check_plan(bound, go_on=False)
    with open(tmp_path / "results/sedimentation/large.nc", "wb") as file:
        file.truncate(disk.total + 2 * 10**9)  # takes no room: a hole
    check_plan(bound, go_on=False)


def test_scenes_that_the_paper_s_formulation_audits_take_seconds_each_and_are_no_more_than_drawn():
    usual, every = of(), of(stokes={"audit_paper": 32_000})
    assert every.seconds - usual.seconds > 5 * 31_000
    assert of(stokes={"audit_paper": 10**6}).seconds == every.seconds
    # No method audits itself.
    solved, audited = (of(stokes={"method": "paper", "audit_paper": n}) for n in (0, 32_000))
    assert solved.seconds == audited.seconds


def test_frozen_clouds_take_the_time_and_memory_of_their_matrices():
    usual, large = of(), of(figures={"frozen_cloud": {"particles": 3000, "clouds": 100}})
    # A matrix of 9,000 rows and its factors, at each of six volume fractions; no core multiplies
    # 1e11 times a second.
    assert large.memory > 2 * 8 * 9000**2
    assert large.seconds - usual.seconds > 600 * 9000**3 / 3 / 1e11


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"scenes": {"number": {"ball": 10**12}}}, "GB of memory to plan its jobs, and this"),
        (
            {"sedimentation": {"particles": [10**7], "duration": 10000, "precision": "float64"}},
            "GB of disk, and this machine has",
        ),
        (
            {"idnn": {"layers": ["9999-9999-9999-9999-9999-9999-9999/9999"], "folds": 100}},
            "GB of memory for its largest job",
        ),
        ({"idnn": {"training": {"epochs": 10**9}}}, "years on 2 cores"),
    ],
)
def test_what_the_machine_cannot_hold_is_refused_unless_told_to_go_on(settings, words):
    bound = of(**settings)

    def begin(go_on):
        check_plan(bound, go_on)
        check_jobs(bound, cores=2, device="cpu", go_on=go_on)

    with pytest.raises(CostError, match=words) as refusal:
        begin(go_on=False)
    assert str(refusal.value).endswith("--config go_on=true.")
    begin(go_on=True)
