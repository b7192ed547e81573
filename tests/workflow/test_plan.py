"""The plan: which jobs a configuration asks for, and under which names."""

import pytest
import yaml

from dustfall.sedimentation import Schedule
from tests.workflow.conftest import files_of
from workflow import plan
from workflow.configuration import configure
from workflow.readers import read_by, readers

UNIFORM = {"idnn": {"laws_of": {"anchored": ["uniform"]}}}
"""What a campaign sets that has scenes of this law alone."""

FIGURES = [
    "force_scatter",
    "force_pdf",
    "spearman",
    "predicted_vs_target",
    "error_by_distance",
    "learning_curve",
    "inverse_beta",
    "settling_in_time",
    "phase_and_spectra",
    "voronoi_pdf",
    "voronoi_variance",
    "cloud_spectra",
    "ergodicity",
    "trajectories",
    "trajectories_3d",
    "frozen_cloud",
    "lifetimes",
    "closures",
    "trajectories_all_particles",
    "mesh_study",
    "audit",
    "scene_meshes",
    "sketches",
]


PLAIN = {
    "models": [],
    "back_flow": False,
    "long": {"particles": []},
    "all_particles": {"particles": []},
}
"""The cases of one model that last as long as the paper's, and no others."""


def test_the_paper_takes_the_expected_jobs_and_fewer_than_a_thousand(project):
    jobs = project.plan("--", "all")
    shards = 2 * (14_000 // 2000) + 4_000 // 2000
    expected = {
        "configuration": 1,
        "scenes": shards,
        "stokes": shards,
        "audit": 1,
        # 2 scenes of each of 3 radial laws
        "scene_mesh": 6,
        "dataset": 1,
        "data_summary": 1,
        # 12 configurations of layers for each of 2 components
        "sweep": 24,
        "winner": 1,
        "model": 5,
        # The anchored IDNN on up to 28,800 scenes of three laws, the IDNN on up to 12,600 of one.
        "trial": 8 + 7 + 9,
        "learning_curve": 1,
        "ablation": 1,
        "evaluation": 1,
        # 2 numbers of particles at 6 volume fractions, 3 Galileo numbers; long ones of 2 numbers,
        # the fewest from 3 starts, and of what is compared: three closed formulas, the anchored
        # IDNN and the back-flow.
        "sedimentation": 2 * 6 + 3 + (3 + 1) * 6 + (4 + 1) * 6,
        "all_particles": 3 * 6,
        "steady_state": 1,
        "independence_of_n": 1,
        "neighbour_changes": 1,
        "mesh_study": 1,
        "movie": 1,
        # The long cases and the Galileo numbers; the densest, five neighbours and all together.
        "voronoi_cells": (3 + 1) * 6 + 3 + 2 + 3,
        "local_volume_fraction": 1,
        "random_spheres": 1,
        "tables": 1,
        **{f"figure_{name}": 1 for name in FIGURES},
    }
    assert jobs == expected
    assert sum(jobs.values()) < 1000


def test_all_asks_for_every_file_so_that_one_that_is_lost_is_made_again(project):
    words = project.dry_run("--configfile", "config/smoke.yaml", "--", "all")
    made = files_of(words, "output")
    assert len(made) > 150
    assert made <= files_of(words, "input")


def test_the_paper_to_the_letter_can_be_planned(project):
    jobs = project.plan("--configfile", "config/paper.yaml", "--", "all")
    config = configure(yaml.safe_load((project.folder / "config/paper.yaml").read_text()))
    # 14,000 scenes are trained and validated on, beside those of the test.
    assert plan.training_scenes(config, "idnn") == 14_000
    assert config["idnn"]["training"]["patience"] == 10_000
    assert jobs["sweep"] == 24
    assert jobs["sedimentation"] == 3 * 6 + 2
    assert "all_particles" not in jobs


def test_figures_is_a_target_that_leaves_the_tables_out(project):
    jobs = project.plan("--", "figures")
    assert "configuration" not in jobs
    assert all(f"figure_{name}" in jobs for name in FIGURES)


def test_exports_is_a_target_with_every_case(project):
    assert project.plan("--", "exports")["export"] == 2 * 6 + 3 + 4 * 6 + 5 * 6 + 3 * 6


@pytest.mark.parametrize(("number", "size"), [(120, 40), (121, 40), (119, 40), (120, 1000)])
def test_shards_hold_every_scene_once(number, size):
    numbers = {"uniform": number, "ball": 7, "contact": 0}
    config = configure({"scenes": {"number": numbers, "shard_size": size}} | UNIFORM)
    scenes = {"uniform": [], "ball": []}
    for name in plan.shards(config):
        law, shard = name.split("-")
        first, last = plan.shard_scenes(config, law, shard)
        assert 0 < last - first <= size
        scenes[law] += range(first, last)
    assert scenes == {"uniform": list(range(number)), "ball": list(range(7))}


def test_more_scenes_leave_the_full_shards_as_they_are():
    few, many = (
        configure({"scenes": {"number": {"uniform": n, "ball": 0, "contact": 0}}} | UNIFORM)
        for n in (4000, 4001)
    )
    assert plan.shards(many)[:2] == plan.shards(few)
    for name in plan.shards(few):
        assert plan.shard_scenes(few, *name.split("-")) == plan.shard_scenes(many, *name.split("-"))


def test_case_names_tell_cases_apart():
    assert plan.Case(1000, 1e-3, 1.0).name == "n1000_phi1e-03_ga1"
    assert plan.Case(1000, 1.5e-3, 1.0).name == "n1000_phi1.5e-03_ga1"
    assert plan.Case(1000, 1e-3, 2.5).name == "n1000_phi1e-03_ga2.5"
    assert plan.Case(1000, 0.1, 4.0).name == "n1000_phi1e-01_ga4"


def test_cases_of_the_galileo_series_are_added_once():
    series = {"galileo": {"particles": 10_000}}
    assert len(plan.cases(configure({"sedimentation": PLAIN | series}))) == 14
    assert len(plan.cases(configure({"sedimentation": PLAIN}))) == 15


def test_further_seeds_leave_the_names_of_the_first_as_they_are():
    one = plan.cases(configure({"sedimentation": {"long": {"seeds": [1]}}}))
    three = plan.cases(configure({"sedimentation": {"seeds": [3]}}))
    more = plan.cases(configure({"sedimentation": {"seeds": [3], "long": {"seeds": [3]}}}))
    assert list(three)[: len(one)] == list(more)[: len(one)] == list(one)
    # Those of the largest clouds, which are of the Galileo numbers alone, and compared long ones
    # have one start.
    single = [name for name, case in one.items() if case.particles == 33_000]
    single += [name for name, case in one.items() if case.long and case.compared]
    assert len(more) == 3 * len(one) - 2 * len(single)
    assert plan.Case(1000, 1e-3, 1.0, 2).name == "n1000_phi1e-03_ga1_seed2"
    assert len({plan.start_stream(case) for case in three}) == len(three)


def test_each_number_of_particles_has_its_number_of_seeds_the_last_for_all_that_follow():
    settle = PLAIN | {
        "particles": [150, 200, 300],
        "seeds": [3, 2],
        "galileo": {"particles": 500},
    }
    cases = plan.cases(configure({"sedimentation": settle})).values()
    seeds = {
        n: max(case.seed for case in cases if case.particles == n) for n in (150, 200, 300, 500)
    }
    assert seeds == {150: 3, 200: 2, 300: 2, 500: 1}


def test_start_file_may_be_one_for_each_case():
    config = configure({"sedimentation": {"start_file": "starts/{case}.nc"}})
    assert plan.start_file(config, "n6_phi1e-03_ga1") == "starts/n6_phi1e-03_ga1.nc"
    assert plan.start_file(configure({}), "n6_phi1e-03_ga1") == []


def test_studies_are_no_part_of_all_and_take_one_run_a_setting(project):
    jobs = project.plan("--config", "sedimentation={model: rotne_prager}", "--", "studies")
    jobs.pop("studies", None)
    assert jobs == {
        "study_of_a_step": 6,
        "step_size": 1,
        # 8 numbers of neighbours at 3 volume fractions
        "study_of_neighbours": 8 * 3,
        "neighbour_numbers": 1,
        "figure_neighbour_numbers": 1,
        "study_of_moving_neighbours": 2,
        "moving_neighbours": 1,
        "moving_spheres": 1,
    }


def test_the_training_in_the_papers_way_has_the_scenes_of_the_campaigns_idnn():
    found = readers()
    for key in ("dataset.file", "idnn.laws"):
        assert {"sweep", "paper_training"} <= set(read_by(key, found))


def test_on_a_cluster_the_training_in_the_papers_way_has_the_time_that_it_takes(project):
    profile = yaml.safe_load((project.folder / "profiles/slurm/config.yaml").read_text())
    minutes = profile["set-resources"]["paper_training"]["runtime"]
    # The 80 minutes of one core, and half as many again for a slower one.
    assert int(minutes.removesuffix(" * attempt")) >= 1.5 * 80


def test_every_file_stays_as_its_checksum_does(project):
    targets = ("all", "exports", "benchmarks", "studies", "openfoam")
    words = project.dry_run("--configfile", "config/smoke.yaml", "--", *targets)
    assert "results/studies/moving_neighbours.nc" in files_of(words, "output")
    assert "temporary" not in words


def test_trial_names_are_file_names_and_lead_back_to_their_layers():
    config = configure({})
    names = [trial.split("/")[1] for trial in plan.trials(config)]
    assert len(plan.trials(config)) == 24
    assert [plan.trial_layers(name) for name in names[:12]] == config["idnn"]["layers"]


def test_learning_curve_ends_with_all_scenes_where_a_model_has_fewer():
    numbers = {"uniform": 120, "ball": 40, "contact": 20}
    config = configure({"scenes": {"number": numbers}, "idnn": {"learning_curve": [50, 500]}})
    assert [name.rsplit("-", 1)[1] for name in plan.learning_curve(config)] == (
        ["50", "162", "50", "108"]
    )


def test_all_particles_start_where_nearest_neighbours_do():
    cases = plan.cases(configure({}))
    together = {name: case for name, case in cases.items() if case.compared == plan.ALL_PARTICLES}
    assert len(together) == 6 * 3
    # Nearest neighbours settle at 33,000 in the densest cloud alone.
    alone = {name for name, case in together.items() if case.start not in cases}
    phis = [f"1e-0{exponent}" for exponent in range(4, 9)]
    assert alone == {f"n33000_phi{phi}_ga1_all_particles" for phi in phis}


def test_every_case_starts_from_its_own_random_numbers():
    config = configure({"sedimentation": PLAIN})
    items = [plan.start_stream(case.start) for case in plan.cases(config).values()]
    assert len(set(items)) == len(items)


def test_compared_models_share_the_starts_of_the_smallest_cases():
    config = configure({"sedimentation": PLAIN | {"models": ["isolated", "idnn"], "seeds": [2]}})
    cases = plan.cases(config)
    compared = {name: case for name, case in cases.items() if case.compared}
    assert len(compared) == 6 * 2
    assert "n1000_phi1e-03_ga1_seed2_isolated" in compared
    for name, case in compared.items():
        assert case.start in cases
        assert plan.force_model(config, name) == "isolated"
        assert plan.force_model(config, case.start) == "idnn"


def test_long_cases_start_where_the_others_do_and_stand_for_the_same_steady_state():
    config = configure({})
    cases = plan.cases(config)
    assert "n1000_phi1e-04_ga1_long" in cases
    assert cases["n1000_phi1e-04_ga1_seed2_long"].start == "n1000_phi1e-04_ga1_seed2"
    settled = plan.settled_cases(config)
    assert "n1000_phi1e-04_ga1_long" in settled
    assert "n1000_phi1e-04_ga1" not in settled
    assert "n33000_phi1e-03_ga2" in settled
    assert "n1000_phi1e-04_ga1_all_particles" in settled
    assert plan.settled_cases(configure({"sedimentation": PLAIN})) == (
        list(plan.cases(configure({"sedimentation": PLAIN})))
    )


def test_a_long_case_lasts_the_longer_the_more_dilute_its_cloud():
    config = configure({})
    times = [plan.schedule(config, f"n1000_phi{phi}_ga1_long") for phi in ("1e-03", "1e-06")]
    for time in times:
        steps = time["duration"] / time["step"]
        assert steps == pytest.approx(round(steps), rel=1e-12)
        assert Schedule(**time).steps == 2500
    # As the square of the spacing: a hundredfold for three decades.
    assert times[1]["duration"] / times[0]["duration"] == pytest.approx(100, rel=0.01)
    start = plan.statistics_from(config, "n1000_phi1e-06_ga1_long")
    assert start / times[1]["duration"] == pytest.approx(0.4, rel=0.01)
    assert plan.statistics_from(config, "n1000_phi1e-06_ga1") == 50


def test_a_formula_added_as_one_file_is_allowed_and_its_cases_are_planned(project):
    name = project.add_documented_formula().stem
    words = project.dry_run("--config", f"sedimentation={{model: {name}}}", "--", "all")
    assert f"n1000_phi1e-03_ga1_{name}_long.nc" not in words  # it is the campaign's own model
    words = project.dry_run("--", "all")
    assert f"results/sedimentation/n1000_phi1e-03_ga1_{name}_long.nc" in words


def test_cases_are_those_of_the_configuration_as_it_stands():
    config = configure({"sedimentation": {"seeds": [1], "long": {"seeds": [1]}}})
    few = plan.cases(config)
    config["sedimentation"]["seeds"] = [100]
    config["sedimentation"]["long"]["seeds"] = [100]
    many = plan.cases(config)
    assert len(many) > 10 * len(few)
    assert few.items() <= many.items()
    assert all(plan.schedule(config, name)["step"] > 0 for name in many)
