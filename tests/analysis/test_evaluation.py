"""Scores of known errors, and symmetries that are broken by just those that break them."""

import numpy as np
import pytest

from dustfall.analysis.evaluation import (
    error_by_gap,
    scores,
    symmetry_violations,
    training_history,
)
from dustfall.dataset import Dataset
from dustfall.forces.formulas.isolated import MODEL as ISOLATED
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.forces.formulas.stokeslets import MODEL as STOKESLETS
from dustfall.scenes import random_scenes


@pytest.fixture(scope="module")
def test_scenes():
    parts = []
    for law in ("uniform", "ball"):
        neighbours, phi = random_scenes(4, law, range(60), (1e-7, 1e-4))
        force = ROTNE_PRAGER.predict(neighbours)
        parts.append(Dataset(neighbours, force, phi, np.full(60, law), np.arange(60)))
    names = ("neighbours", "force", "volume_fraction", "radial_law", "scene")
    return Dataset(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def test_scores_of_a_known_error(test_scenes):
    shift = np.zeros((120, 3))
    shift[:60] = [0.3, -2.0, 0.4]
    table = scores({"shifted": test_scenes.force + shift}, test_scenes)
    whole = table.groupby(["radial_law", "component"], sort=False).first()
    assert whole.loc["uniform", "streamwise"]["rms_error"] == pytest.approx(2.0)
    assert whole.loc["uniform", "lateral"]["rms_error"] == pytest.approx(np.sqrt(0.125))
    assert whole.loc["uniform", "lateral"]["largest_error"] == pytest.approx(0.4)
    assert whole.loc["ball", "streamwise"]["r2"] == 1.0
    variance = test_scenes.force[:60, 1].var()
    assert whole.loc["uniform", "streamwise"]["r2"] == pytest.approx(1 - 4 / variance)


def test_scores_count_each_scene_once_in_its_decade(test_scenes):
    table = scores({"exact": test_scenes.force}, test_scenes)
    one = table[(table["component"] == "lateral") & (table["radial_law"] == "ball")]
    assert one["samples"].tolist()[0] == 60
    assert one["samples"].tolist()[0] == sum(one["samples"].tolist()[1:])


@pytest.mark.parametrize("laws", [["uniform"], ["uniform", "ball"]])
def test_a_training_is_told_with_what_its_kept_weights_reach(models, test_scenes, laws):
    model, test = models["idnn"], test_scenes.of_laws(laws)
    table = training_history(model, test).set_index("component")
    for component, history in model.history.items():
        own = table.loc[component]
        assert own["epoch"].tolist() == history.epochs == [5, 10, 15, 20, 25]
        assert own["validation_error"].tolist() == history.validation_error
        assert own["r2"].nunique() == 1
    force = model.predict(test.neighbours)[:, 1]
    unexplained = ((force - test.force[:, 1]) ** 2).mean() / test.force[:, 1].var()
    assert table.loc["streamwise", "r2"].iloc[0] == pytest.approx(1 - unexplained)


def test_errors_are_sorted_into_gaps(test_scenes):
    gap = np.linalg.norm(test_scenes.neighbours, axis=2).min(axis=1) - 1
    predicted = test_scenes.force + np.outer(1 / (1 + gap), [0.0, 0.6, 0.8])
    table = error_by_gap({"model": predicted}, test_scenes.force, gap, bins=10)
    assert table["samples"].tolist() == [12] * 10
    np.testing.assert_allclose(table["rms_error"], 1 / (1 + table["gap"]), rtol=0.5)
    assert (np.diff(table["rms_error"]) < 0).all()


class SidewaysDrift:
    name = "drift"

    def predict(self, neighbours):
        return np.tile([0.5, 24.0, 0.0], (len(neighbours), 1))


class PolarBias:
    name = "bias"

    def predict(self, neighbours):
        return np.stack([0 * neighbours[:, 0, 1], neighbours[:, 0, 1], 0 * neighbours[:, 0, 1]], 1)


def test_symmetries_are_broken_by_just_those_models_that_break_them(test_scenes):
    neighbours = test_scenes.neighbours
    models = [
        ISOLATED,
        STOKESLETS,
        ROTNE_PRAGER,
        SidewaysDrift(),
        PolarBias(),
    ]
    table = symmetry_violations(models, neighbours).set_index(["model", "symmetry"])["largest"]
    for name in ("isolated", "stokeslets", "rotne_prager"):
        assert (table[name] < 1e-12).all()
    assert table["drift", "inversion"] == 0.0
    assert table["drift", "mirror"] == pytest.approx(1.0)
    assert table["drift", "rotation"] == pytest.approx(2 * 0.5 * np.sin(0.5))
    assert table["bias", "inversion"] == pytest.approx(2 * np.abs(neighbours[:, 0, 1]).max())
