"""The audit draws fairly, finds a wrong force, and stops the campaign with the scene's number."""

import numpy as np
import pandas as pd
import pytest

from dustfall.benchmarks.audit import audit, audit_sample, require_agreement
from dustfall.scenes import random_scenes
from dustfall.stokes.records import solve_shard


@pytest.fixture(scope="module")
def shard():
    neighbours, phi = random_scenes(1, "uniform", range(3), (1e-8, 1e-3))
    scenes = {"neighbours": neighbours, "volume_fraction": phi, "scene": np.arange(3)}
    return scenes, solve_shard(neighbours, 1e-6)


def test_every_decade_is_drawn_from_alike():
    phi = 10.0 ** np.random.default_rng(1).uniform(-8.0, -3.0, 1000)
    drawn = audit_sample("ball", phi, 50, seed=1)
    decades = np.floor(np.log10(phi[drawn]))
    assert np.unique(decades, return_counts=True)[1].tolist() == [10] * 5
    assert len(np.unique(drawn)) == 50


def test_a_sample_depends_on_seed_and_law_alone_and_a_larger_one_holds_it():
    phi = 10.0 ** np.random.default_rng(2).uniform(-8.0, -3.0, 300)
    few, many = (audit_sample("uniform", phi, number, seed=3) for number in (20, 40))
    assert set(few) <= set(many)
    np.testing.assert_array_equal(few, audit_sample("uniform", phi, 20, seed=3))
    assert set(few) != set(audit_sample("contact", phi, 20, seed=3))
    assert set(few) != set(audit_sample("uniform", phi, 20, seed=4))


def test_a_sample_larger_than_the_law_is_the_whole_law():
    phi = np.array([1e-4, 2e-4, 1e-7])
    np.testing.assert_array_equal(audit_sample("uniform", phi, 10, seed=1), [0, 1, 2])


def test_methods_agree_within_their_estimates(shard):
    scenes, records = shard
    # A scene by the paper's way takes as long as the others together.
    one = ({name: values[:1] for name, values in part.items()} for part in (scenes, records))
    table = pd.concat(
        [
            audit("uniform", scenes, records, ["elements"], 1e-4),
            audit("uniform", *one, ["paper"], 1e-4),
        ]
    )
    assert table["method"].tolist() == ["elements"] * 3 + ["paper"]
    assert (table["excess"] <= 1.0).all()
    assert set(table.loc[table["method"] == "elements", "status"]) == {"converged"}
    # Flat elements in the paper's outer sphere: percents, and they say so.
    paper = table[table["method"] == "paper"]
    assert paper["difference"].between(1e-3, 0.1).all()
    assert set(paper["status"]) == {"out of reach"}
    require_agreement(table)


@pytest.mark.parametrize("error", [1e-3, -2e-4])
def test_a_wrong_force_on_record_stops_with_the_number_of_its_scene(shard, error):
    scenes, records = shard
    force = records["force"].copy()
    force[1, 4, 2] += 24.0 * error
    table = audit("uniform", scenes, records | {"force": force}, ["elements"], 1e-4)
    with pytest.raises(RuntimeError, match="scene 1 of radial law uniform"):
        require_agreement(table)


def test_a_force_that_was_not_found_is_no_disagreement(shard):
    scenes, records = shard
    status = records["status"].astype("U16")
    status[2] = "not converged"
    force = records["force"].copy()
    force[2] = 0.0
    table = audit(
        "uniform", scenes, records | {"force": force, "status": status}, ["elements"], 1e-4
    )
    require_agreement(table)
    assert np.isnan(table["excess"].iloc[2])


def test_a_touching_pair_is_no_disagreement():
    touching = np.array([[[0.0, 0.0, 1.0 + 1e-7], [9, 0, 0], [0, 9, 0], [0, 0, 9], [0, 0, -9.0]]])
    scenes = {"neighbours": touching, "volume_fraction": [8e-4], "scene": [7]}
    table = audit("contact", scenes, solve_shard(touching, 1e-3), ["elements"], 1e-4)
    require_agreement(table)
    assert table["status"].tolist() == ["out of reach"]
