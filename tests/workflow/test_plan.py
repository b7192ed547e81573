"""The plan: which jobs a configuration asks for, and under which names."""

import pytest

from workflow import plan
from workflow.configuration import configure

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
    "mesh_study",
    "audit",
    "scene_meshes",
]


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
        # 3 numbers of particles, the fewest from 3 starts, 6 volume fractions, 2 more Galileo
        # numbers, 4 models to compare: three closed formulas and the anchored IDNN
        "sedimentation": (3 + 1 + 1) * 6 + 2 + 4 * 3 * 6,
        # The fewest particles from 3 starts, ten times as many from one.
        "all_particles": (3 + 1) * 6,
        "steady_state": 1,
        "independence_of_n": 1,
        "neighbour_changes": 1,
        "mesh_study": 1,
        "movie": 1,
        "voronoi_cells": (3 + 1 + 1) * 6 + 2,
        "random_spheres": 1,
        **{f"figure_{name}": 1 for name in FIGURES},
    }
    assert jobs == expected
    assert sum(jobs.values()) < 1000


def test_figures_is_a_target_that_leaves_the_tables_out(project):
    jobs = project.plan("--", "figures")
    assert "configuration" not in jobs
    assert all(f"figure_{name}" in jobs for name in FIGURES)


def test_exports_is_a_target_with_every_case(project):
    assert project.plan("--", "exports")["export"] == 5 * 6 + 2 + 12 * 6 + 4 * 6


@pytest.mark.parametrize(("number", "size"), [(120, 40), (121, 40), (119, 40), (120, 1000)])
def test_shards_hold_every_scene_once(number, size):
    numbers = {"uniform": number, "ball": 7, "contact": 0}
    config = configure({"scenes": {"number": numbers, "shard_size": size}})
    scenes = {"uniform": [], "ball": []}
    for name in plan.shards(config):
        law, shard = name.split("-")
        first, last = plan.shard_scenes(config, law, shard)
        assert 0 < last - first <= size
        scenes[law] += range(first, last)
    assert scenes == {"uniform": list(range(number)), "ball": list(range(7))}


def test_more_scenes_leave_the_full_shards_as_they_are():
    few, many = (
        configure({"scenes": {"number": {"uniform": n, "ball": 0, "contact": 0}}})
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
    one = {"models": [], "seeds": [1], "all_particles": {"particles": []}}
    assert len(plan.cases(configure({"sedimentation": one}))) == 20
    apart = configure({"sedimentation": one | {"galileo": {"particles": 500}}})
    assert len(plan.cases(apart)) == 21


def test_further_seeds_leave_the_names_of_the_first_as_they_are():
    one = plan.cases(configure({"sedimentation": {"seeds": [1]}}))
    three = plan.cases(configure({"sedimentation": {"seeds": [3]}}))
    assert len(three) == 3 * len(one)
    assert list(three)[: len(one)] == list(one)
    assert plan.Case(1000, 1e-3, 1.0, 2).name == "n1000_phi1e-03_ga1_seed2"
    assert len({plan.start_stream(case) for case in three}) == len(three)


def test_each_number_of_particles_has_its_number_of_seeds_the_last_for_all_that_follow():
    settle = {
        "particles": [15, 20, 30],
        "seeds": [3, 2],
        "galileo": {"particles": 500},
        "all_particles": {"particles": []},
    }
    cases = plan.cases(configure({"sedimentation": settle})).values()
    seeds = {n: max(case.seed for case in cases if case.particles == n) for n in (15, 20, 30, 500)}
    assert seeds == {15: 3, 20: 2, 30: 2, 500: 1}


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
        # 6 numbers of neighbours at 3 volume fractions
        "study_of_neighbours": 6 * 3,
        "neighbour_numbers": 1,
    }


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
    together = [case for case in cases.values() if case.compared == plan.ALL_PARTICLES]
    assert len(together) == 6 * (3 + 1)
    assert all(case.start in cases for case in together)


def test_every_case_starts_from_its_own_random_numbers():
    config = configure({"sedimentation": {"models": [], "all_particles": {"particles": []}}})
    items = [plan.start_stream(case.start) for case in plan.cases(config).values()]
    assert len(set(items)) == len(items)


def test_compared_models_share_the_starts_of_the_smallest_cases():
    config = configure(
        {
            "sedimentation": {
                "models": ["isolated", "idnn"],
                "seeds": [2],
                "all_particles": {"particles": []},
            }
        }
    )
    cases = plan.cases(config)
    compared = {name: case for name, case in cases.items() if case.compared}
    assert len(compared) == 6 * 2
    assert "n1000_phi1e-03_ga1_seed2_isolated" in compared
    for name, case in compared.items():
        assert case.start in cases
        assert plan.force_model(config, name) == "isolated"
        assert plan.force_model(config, case.start) == "idnn"


def test_a_formula_added_as_one_file_is_allowed_and_its_cases_are_planned(project):
    name = project.add_documented_formula().stem
    words = project.dry_run("--config", f"sedimentation={{model: {name}}}", "--", "all")
    assert f"n1000_phi1e-03_ga1_seed3_{name}.nc" not in words  # it is the campaign's own model
    words = project.dry_run("--", "all")
    assert f"results/sedimentation/n1000_phi1e-03_ga1_seed3_{name}.nc" in words
