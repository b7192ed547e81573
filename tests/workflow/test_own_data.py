"""A data set of one's own takes the place of scenes and their solution."""

import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from dustfall.dataset import read
from dustfall.forces import load_model
from tests.workflow.conftest import ROOT, Project

SMALL = (
    *("--configfile", "config/smoke.yaml", "--config", "dataset={file: fixed_array.csv}"),
    "idnn={layers: [10/10], training: {epochs: 10}, training_of: {anchored: {epochs: 10}}}",
)


@pytest.fixture(scope="module")
def own(tmp_path_factory) -> Project:
    """A project with the file that docs/extend.md makes: spheres held in a periodic cube."""
    project = Project(tmp_path_factory.mktemp("own"))
    page = (ROOT / "docs/extend.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.S)
    code = next(block for block in blocks if "fixed_array.csv" in block)
    subprocess.run([sys.executable, "-c", code], cwd=project.folder, check=True)
    return project


def test_nothing_is_drawn_or_solved_and_all_else_is_planned(own):
    ordinary = own.plan("--configfile", "config/smoke.yaml", "--", "all")
    jobs = own.plan(*SMALL, "--", "all")
    left_out = {"scenes", "stokes", "audit", "scene_mesh", "mesh_study", "dataset"}
    left_out |= {"figure_audit", "figure_mesh_study", "figure_scene_meshes"}
    assert set(ordinary) - set(jobs) == left_out
    assert set(jobs) - set(ordinary) == {"own_data"}


@pytest.mark.slow
def test_models_of_ten_neighbours_are_swept_trained_and_drawn_and_settle_a_cloud(own):
    cloud = "results/sedimentation/n100_phi1e-03_ga1.series.nc"
    own.run(*SMALL, "--", cloud, "results/figures/spearman.png")
    results = own.folder / "results"
    dataset = read(results / "dataset/forces.h5")
    table = pd.read_csv(own.folder / "fixed_array.csv")
    np.testing.assert_array_equal(dataset.force, table[["force_x", "force_y", "force_z"]])
    model = load_model(results / "model/idnn.safetensors")
    assert model.neighbours == 10
    assert model.predict(dataset.neighbours).shape == dataset.force.shape
    with xr.open_dataset(own.folder / cloud) as series:
        assert series.attrs["model"] == "idnn"
        assert series.attrs["neighbours"] == 10
        assert np.isfinite(series["settling_velocity_mean"]).all()


def test_the_pages_of_the_docs_are_refused_before_any_file_of_theirs_changes(own):
    docs = own.folder / "docs"
    assert own.plan(*SMALL, "--", "validation") == {"validation": 1}
    before = {path: path.read_bytes() for path in docs.rglob("*") if path.is_file()}
    done = own.snakemake("--cores", "1", *SMALL, "--", "validation")
    assert done.returncode == 1
    sentence = "Stopped: validation: dataset.file is fixed_array.csv, but must be empty: the pages"
    assert done.stderr.splitlines()[-1].startswith(sentence)
    assert {path: path.read_bytes() for path in docs.rglob("*") if path.is_file()} == before


@pytest.mark.slow
def test_a_cloud_is_as_crowded_as_the_densest_scene_of_ones_own_data_and_not_of_the_drawn(own):
    table = pd.read_csv(own.folder / "fixed_array.csv")
    share = []
    # All but the last scene are far more dilute than any cloud; the last is as dense as told.
    for densest in (1e-9, 0.5):
        table["volume_fraction"] = [*[1e-10] * (len(table) - 1), densest]
        table.to_csv(own.folder / "dense.csv", index=False)
        settings = [
            "dataset={file: dense.csv}",
            "sedimentation={model: rotne_prager, particles: [100], volume_fractions: [1.0e-3], "
            "long: {particles: []}, all_particles: {particles: []}}",
        ]
        file = "results/analysis/local_volume_fraction.csv"
        own.run(
            *("--configfile", "config/smoke.yaml", "--cores", "1", "--config"),
            *settings,
            "--",
            file,
        )
        share.append(pd.read_csv(own.folder / file)["above"])
    assert (share[0] == 1).all()
    assert (share[1] < 1e-3).all()


def test_files_that_do_not_fit_are_refused_with_a_sentence(own):
    (own.folder / "few.csv").write_text(
        "x1,y1,z1,force_x,force_y,force_z\n" + "1,2,3,4,5,6\n" * 100
    )
    for file, sentence in (
        ("none.csv", "dataset.file: there is no file none.csv."),
        ("few.csv", "dataset.file is few.csv, which has 1 neighbours a scene, but must have 3 to"),
    ):
        done = own.snakemake(
            "--configfile", "config/smoke.yaml", "--config", f"dataset={{file: {file}}}", "-n"
        )
        assert f"Configuration: {sentence}" in done.stdout + done.stderr
        assert "Traceback" not in done.stdout + done.stderr
