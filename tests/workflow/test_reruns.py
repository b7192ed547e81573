"""An edited key or file reruns what depends on it, and nothing else."""

import re

import pytest
import yaml

from tests.workflow.conftest import jobs_of
from workflow.library import ROOT, SHIPPED
from workflow.readers import read_by, readers

SMOKE = ("--configfile", "config/smoke.yaml")
READERS = readers()
CHOSEN_FROM = {
    "idnn.laws_of.anchored",
    "idnn.layers_of.dense",
    "scenes.number.uniform",
    "sedimentation.galileo.multiples",
    "sedimentation.models",
    "sedimentation.statistics_from",
}
"""Keys of models, cases or scenes, of which some of the rules that look them up take a part."""

SHARDS = {"scenes": 5, "stokes": 5}
MESHED = {"scene_mesh": 3, "figure_scene_meshes": 1}
AUDIT = {"audit": 1, "figure_audit": 1}
DATA_FIGURES = {"figure_force_scatter": 1, "figure_force_pdf": 1, "figure_spearman": 1}
SCORES = {"evaluation": 1, "figure_predicted_vs_target": 1, "figure_error_by_distance": 1}
TRIALS = {"trial": 13, "learning_curve": 1, "ablation": 1, "figure_learning_curve": 1}
SKETCHES = {"figure_sketches": 1}
MODELS = {"sweep": 4, "winner": 1, "model": 5, **SCORES, **TRIALS, **SKETCHES}
STEADY_TABLE = {
    "steady_state": 1,
    "independence_of_n": 1,
    "figure_inverse_beta": 1,
    "figure_voronoi_variance": 1,
}
SPECTRA = {"figure_phase_and_spectra": 1, "figure_cloud_spectra": 1}
CELLS = {"voronoi_cells": 8, "figure_voronoi_pdf": 1, "figure_closures": 1}
LASTING = {"figure_lifetimes": 1, "local_volume_fraction": 1}
TOGETHER = {
    "all_particles": 3,
    "voronoi_cells": 1,
    "figure_closures": 1,
    "figure_trajectories_all_particles": 1,
}
STEADY = {
    "neighbour_changes": 1,
    "figure_ergodicity": 1,
    **CELLS,
    **LASTING,
    **SPECTRA,
    **STEADY_TABLE,
}
PATHS = {
    "figure_settling_in_time": 1,
    "figure_trajectories": 1,
    "figure_trajectories_3d": 1,
    "movie": 1,
}
SETTLING = {
    "sedimentation": 13,
    **PATHS,
    **STEADY,
}
# Three more cases have a model that no data were needed for.
ALL_SETTLING = SETTLING | {"sedimentation": 16}
# What the cases that last as long as the paper's are needed for.
SHORT = {
    "neighbour_changes": 1,
    "figure_phase_and_spectra": 1,
    **CELLS,
    "voronoi_cells": 6,
    **STEADY_TABLE,
}
TABLES = {
    "audit",
    "dataset",
    "data_summary",
    "winner",
    "learning_curve",
    "ablation",
    "evaluation",
    "steady_state",
    "independence_of_n",
    "neighbour_changes",
    "local_volume_fraction",
}
"""Rules whose tables the report shows."""
FROM_DATA = {"dataset": 1, "data_summary": 1, **DATA_FIGURES, **MODELS, **SETTLING}


def with_tables(jobs: dict[str, int]) -> dict[str, int]:
    """Jobs, and the one that makes pages of tables, where any of these changes."""
    return jobs | ({"tables": 1} if TABLES & set(jobs) else {})


def leaves(path: str, value) -> list[str]:
    """Keys, written with dots, that a setting of a section sets."""
    if not isinstance(value, dict):
        return [path]
    return [leaf for name, inner in value.items() for leaf in leaves(f"{path}.{name}", inner)]


def changed_themselves(words: str) -> set[str]:
    """Rules of jobs that a dry run announces because of their own parameters or list of inputs."""
    jobs = re.findall(r"^rule (\w+):$(.*?)^    reason: (.*?)$", words, re.M | re.S)
    return {
        rule
        for rule, _, reason in jobs
        if "Params have changed" in reason or "Set of input files has changed" in reason
    }


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("scenes={phi_max: 5.0e-4}", SHARDS | MESHED | AUDIT | FROM_DATA),
        # The formulas that clouds are compared by take as many as the models that learn.
        ("scenes={neighbours: 4}", SHARDS | MESHED | AUDIT | FROM_DATA | ALL_SETTLING),
        # A fourth shard, and all that depends on the data set.
        (
            "scenes={number: {uniform: 150}}",
            {"scenes": 1, "stokes": 1} | AUDIT | FROM_DATA,
        ),
        ("meshing={study_sizes: [0.9, 0.7, 0.5]}", {"mesh_study": 1, "figure_mesh_study": 1}),
        ("stokes={tolerance: 1.0e-3}", {"stokes": 5} | MESHED | AUDIT | FROM_DATA),
        ("dataset={unconverged_share: 0.02}", FROM_DATA),
        ("dataset={test_share: 0.2}", MODELS | SETTLING),
        (
            # What stands on a baseline has its own number of epochs.
            "idnn={training: {epochs: 70}}",
            MODELS | SETTLING | {"model": 4, "trial": 8},
        ),
        ("idnn={layers_of: {dense: 30-30}}", {"model": 1, **SCORES}),
        (
            "idnn={layers: [10/10, 20-20/20-20, 5/5]}",
            {"sweep": 2, "winner": 1, "model": 1} | SCORES | SKETCHES | SETTLING,
        ),
        (
            "idnn={laws_of: {anchored: [uniform]}}",
            {"model": 1, "trial": 2, "learning_curve": 1, "figure_learning_curve": 1, **SCORES},
        ),
        (
            "idnn={learning_curve: [40, 60, 80]}",
            {"trial": 2, "learning_curve": 1, "figure_learning_curve": 1},
        ),
        (
            "sedimentation={step: 0.05}",
            SHORT | PATHS | TOGETHER | {"sedimentation": 7, "voronoi_cells": 6},
        ),
        (
            "sedimentation={long: {duration: 5}}",
            {
                "sedimentation": 9,
                "neighbour_changes": 1,
                "voronoi_cells": 3,
                "figure_settling_in_time": 1,
                "figure_ergodicity": 1,
                "figure_cloud_spectra": 1,
            }
            | LASTING
            | STEADY_TABLE,
        ),
        (
            "sedimentation={all_particles: {fluid: quasi_steady}}",
            TOGETHER | STEADY_TABLE,
        ),
        (
            "sedimentation={galileo: {multiples: [1, 2, 3]}}",
            {
                "sedimentation": 1,
                "voronoi_cells": 1,
                "neighbour_changes": 1,
                "figure_voronoi_pdf": 1,
            }
            | STEADY_TABLE,
        ),
        ("sedimentation={statistics_from: 5}", SHORT),
        (
            "sedimentation={models: [rotne_prager, isolated]}",
            {"sedimentation": 3, "neighbour_changes": 1} | STEADY_TABLE,
        ),
        ("figures={samples: 500}", {"figure_force_scatter": 1, "figure_predicted_vs_target": 1}),
        ("figures={spectrum: welch}", {"figure_phase_and_spectra": 1}),
        ("figures={fit_frequencies: [0, 2]}", SPECTRA),
        ("figures={frozen_cloud: {clouds: 3}}", {"figure_frozen_cloud": 1}),
    ],
)
def test_an_edited_key_reruns_what_depends_on_it_and_nothing_else(rehearsal, setting, expected):
    words = rehearsal.dry_run(*SMOKE, "--config", setting, "--", "all")
    jobs = jobs_of(words)
    assert jobs.pop("configuration") == 1
    assert jobs == with_tables(expected)
    # A job reruns for what it reads itself, or for a file that another job makes anew.
    section, inner = next(iter(yaml.safe_load(setting.replace("=", ": ", 1)).items()))
    keys = leaves(section, inner)
    reading = {rule for key in keys for rule in read_by(key, READERS)}
    assert changed_themselves(words) <= reading | {"configuration"}
    if not CHOSEN_FROM.intersection(keys):
        assert reading & rehearsal.rules <= set(jobs)


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("scenes.py", SHARDS | MESHED | AUDIT | FROM_DATA),
        ("stokes/records.py", {"stokes": 5} | AUDIT | FROM_DATA),
        ("dataset.py", AUDIT | FROM_DATA),
        ("training/fit.py", MODELS | SETTLING),
        ("sedimentation/settle.py", ALL_SETTLING | TOGETHER | {"voronoi_cells": 9}),
        ("suspension/ewald.py", TOGETHER | STEADY_TABLE),
        (
            "analysis/voronoi.py",
            {
                "random_spheres": 1,
                **CELLS,
                "voronoi_cells": 9,
                "figure_voronoi_variance": 1,
                "figure_lifetimes": 1,
            },
        ),
        ("figures/mesh.py", {"figure_mesh_study": 1}),
        ("progress.py", {}),
    ],
)
def test_edited_library_code_reruns_its_stage_and_nothing_else(rehearsal, file, expected):
    path = rehearsal.folder / "dustfall" / file
    code = path.read_bytes()
    try:
        path.write_bytes(code + b"\n# edited\n")
        assert rehearsal.plan(*SMOKE, "--", "all") == with_tables(expected)
    finally:
        path.write_bytes(code)


def test_a_new_time_of_a_library_file_is_no_edit(rehearsal):
    for path in (rehearsal.folder / "dustfall").rglob("*.py"):
        path.touch()
    assert rehearsal.plan(*SMOKE, "--", "all") == {}


@pytest.mark.parametrize("key", ["scenes.neighbours", "dataset.file", "sedimentation.model"])
def test_the_study_of_steps_has_the_model_and_the_neighbours_of_the_campaign(key):
    assert {"sedimentation", "study_of_a_step"} <= set(read_by(key, READERS))


def test_another_model_that_ships_reruns_what_loads_it_and_no_training_or_settling(rehearsal):
    table = "results/studies/moving_spheres.csv"
    (rehearsal.folder / table).parent.mkdir(parents=True, exist_ok=True)
    (rehearsal.folder / table).touch()
    rehearsal.run(*SMOKE, "--touch", "--forceall", "--", table)
    path = rehearsal.folder / SHIPPED.relative_to(ROOT)
    model = path.read_bytes()
    try:
        path.write_bytes(model + b"another")
        assert rehearsal.plan(*SMOKE, "--", "all", table) == {"moving_spheres": 1}
    finally:
        path.write_bytes(model)
    assert rehearsal.plan(*SMOKE, "--", "all", table) == {}


def test_a_formula_added_as_one_file_reruns_what_compares_models_and_no_training(rehearsal):
    formula = rehearsal.add_documented_formula()
    try:
        jobs = rehearsal.plan(*SMOKE, "--config", "sedimentation={models: [formulas]}", "--", "all")
    finally:
        formula.unlink()
    assert "evaluation" in jobs
    assert not {"stokes", "dataset", "sweep", "model", "trial"} & set(jobs)
    # The new formula and two that the smoke campaign leaves out, at three volume fractions.
    assert jobs["sedimentation"] == 3 * 3
