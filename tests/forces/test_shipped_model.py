"""The model that ships with the package is as good as reported, on scenes it has never seen."""

import numpy as np
import pytest

from dustfall.forces import load_model
from dustfall.forces.formulas.reflections import MODEL as REFLECTED
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.scenes import random_scenes
from dustfall.stokes import forces_on_fixed_spheres


@pytest.fixture(scope="module")
def scenes():
    """Scenes of another seed than the campaign's, with forces by boundary elements."""
    neighbours, _ = random_scenes(2, "uniform", range(300), (1e-8, 1e-3))
    centres = np.concatenate([np.zeros((len(neighbours), 1, 3)), neighbours], axis=1)
    return neighbours, np.array(
        [forces_on_fixed_spheres(scene, tolerance=3e-4)[0] for scene in centres]
    )


def unexplained(predicted, target):
    """1 - R^2 of the streamwise and of both lateral components."""
    error, spread = ((target - reference) ** 2 for reference in (predicted, target.mean(axis=0)))
    return error[:, 1].sum() / spread[:, 1].sum(), error[:, ::2].sum() / spread[:, ::2].sum()


def test_shipped_model_keeps_its_reported_accuracy(scenes):
    neighbours, force = scenes
    streamwise, lateral = unexplained(load_model().predict(neighbours), force)
    assert streamwise < 1e-5
    assert lateral < 1e-4


@pytest.mark.parametrize("formula", [ROTNE_PRAGER, REFLECTED])
def test_shipped_model_beats_the_formulas_that_it_stands_on(scenes, formula):
    neighbours, force = scenes
    shipped = unexplained(load_model().predict(neighbours), force)
    formula = unexplained(formula.predict(neighbours), force)
    assert shipped[0] < 0.8 * formula[0]
    assert shipped[1] < 0.8 * formula[1]


def test_shipped_model_says_where_it_comes_from():
    header = load_model().header
    assert header["kind"] == "anchored"
    assert len(header["training"]["data_sha256"]) == 64
    assert header["training"]["samples"] >= 25_000
    assert header["training"]["command"] == "snakemake -- results/model/anchored.safetensors"
    assert header["units"] == {"length": "d_p", "force": "Re_p c_D"}
