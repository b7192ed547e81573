"""The smoke campaign through Snakemake: whole, repeatable, rerun no further than an edit asks."""

import h5py
import numpy as np
import pytest

pytestmark = pytest.mark.slow

SMOKE = ("--configfile", "config/smoke.yaml")

SHARDS = {"scenes": 5, "stokes": 5}
DATA_FIGURES = {"figure_force_scatter": 1, "figure_force_pdf": 1, "figure_spearman": 1}
SCORES = {"evaluation": 1, "figure_predicted_vs_target": 1, "figure_error_by_distance": 1}
TRIALS = {"trial": 13, "learning_curve": 1, "ablation": 1, "figure_learning_curve": 1}
MODELS = {"sweep": 4, "winner": 1, "model": 5, **SCORES, **TRIALS}
STEADY_TABLE = {
    "steady_state": 1,
    "independence_of_n": 1,
    "figure_inverse_beta": 1,
    "figure_voronoi_variance": 1,
}
SPECTRA = {"figure_phase_and_spectra": 1, "figure_cloud_spectra": 1}
CELLS = {"voronoi_cells": 7, "figure_voronoi_pdf": 1}
STEADY = {
    "neighbour_changes": 1,
    "figure_ergodicity": 1,
    **CELLS,
    **SPECTRA,
    **STEADY_TABLE,
}
SETTLING = {
    "sedimentation": 7,
    "figure_settling_in_time": 1,
    "figure_trajectories": 1,
    "figure_trajectories_3d": 1,
    "movie": 1,
    **STEADY,
}
# Three more cases have a model that no data were needed for.
ALL_SETTLING = SETTLING | {"sedimentation": 10}
FROM_DATA = {"dataset": 1, "data_summary": 1, **DATA_FIGURES, **MODELS, **SETTLING}


def test_every_figure_is_there_with_its_numbers(campaign):
    folder = campaign.folder / "results/figures"
    pictures = sorted(folder.glob("*.png"))
    assert len(pictures) == 17
    for picture in pictures:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
        assert len(picture.with_suffix(".csv").read_text().splitlines()) > 1
    assert (folder / "settling_cloud.gif").read_bytes().startswith(b"GIF89a")


def test_a_second_run_has_nothing_to_do(campaign):
    assert campaign.plan(*SMOKE, "--", "all") == {}


def test_bits_of_the_data_hang_neither_on_cores_nor_on_shard_size(campaign, tmp_path):
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


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("scenes={phi_max: 5.0e-4}", SHARDS | FROM_DATA),
        # A fourth shard, and all that hangs on the data set.
        (
            "scenes={number: {uniform: 150}}",
            {"scenes": 1, "stokes": 1} | FROM_DATA,
        ),
        ("meshing={study_sizes: [0.9, 0.7, 0.5]}", {"mesh_study": 1, "figure_mesh_study": 1}),
        ("stokes={tolerance: 1.0e-3}", {"stokes": 5} | FROM_DATA),
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
            {"sweep": 2, "winner": 1, "model": 1} | SCORES | SETTLING,
        ),
        (
            "idnn={laws_of: {anchored: [uniform]}}",
            {"model": 1, "trial": 2, "learning_curve": 1, "figure_learning_curve": 1, **SCORES},
        ),
        (
            "idnn={learning_curve: [40, 60, 80]}",
            {"trial": 2, "learning_curve": 1, "figure_learning_curve": 1},
        ),
        ("sedimentation={step: 0.05}", ALL_SETTLING),
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
        ("sedimentation={statistics_from: 5}", STEADY),
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
def test_an_edited_key_reruns_what_hangs_on_it_and_nothing_else(campaign, setting, expected):
    jobs = campaign.plan(*SMOKE, "--config", setting, "--", "all")
    assert jobs.pop("configuration") == 1
    assert jobs == expected


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("scenes.py", SHARDS | FROM_DATA),
        ("stokes/records.py", {"stokes": 5} | FROM_DATA),
        ("dataset.py", FROM_DATA),
        ("training/fit.py", MODELS | SETTLING),
        ("sedimentation/dynamics.py", ALL_SETTLING),
        ("analysis/voronoi.py", {"random_spheres": 1, **CELLS, "figure_voronoi_variance": 1}),
        ("figures/mesh.py", {"figure_mesh_study": 1}),
        ("progress.py", {}),
    ],
)
def test_edited_library_code_reruns_its_stage_and_nothing_else(campaign, file, expected):
    path = campaign.folder / "dustfall" / file
    code = path.read_bytes()
    try:
        path.write_bytes(code + b"\n# edited\n")
        assert campaign.plan(*SMOKE, "--", "all") == expected
    finally:
        path.write_bytes(code)
    # The same bytes with a new time are no edit.
    assert campaign.plan(*SMOKE, "--", "all") == {}


def test_a_lost_result_is_made_again_with_the_same_bytes(campaign):
    figure = campaign.folder / "results/figures/voronoi_pdf.png"
    before = figure.read_bytes()
    figure.unlink()
    campaign.run(*SMOKE, "--", "all")
    assert figure.read_bytes() == before
