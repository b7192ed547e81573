"""The benchmark compares what it says: peers on their own code, errors against one truth."""

import numpy as np
import pytest

from dustfall.benchmarks.solver import (
    Method,
    _plain,
    methods,
    rotne_prager,
    solver,
    time_against_error,
    time_against_spheres,
)
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.scenes import random_scenes
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres


@pytest.fixture(scope="module")
def scenes():
    neighbours, _ = random_scenes(2, "uniform", range(6), (1e-4, 1e-3))
    return np.concatenate([np.zeros((6, 1, 3)), neighbours], axis=1)


def test_the_peer_and_the_force_model_invert_the_same_mobility(scenes):
    ours = ROTNE_PRAGER.predict(scenes[:, 1:])
    theirs = np.array([rotne_prager(centres)[0] for centres in scenes])
    np.testing.assert_allclose(theirs, ours, rtol=1e-10)


def test_errors_are_those_of_the_reference_sphere(scenes):
    """Two spheres alone, where the exact force says what the table must hold."""
    pair = np.array([[[0.0, 0.0, 0.0], [0.4, 0.1, 1.3]]])
    exact = forces_on_two_spheres(pair[0])[0]
    table = time_against_error(
        {"pair": pair}, [Method("peer", "", _plain(rotne_prager), 5)], repeats=1
    )
    row = table.iloc[0]
    assert row["scenes"] == 1
    expected = np.abs(rotne_prager(pair[0])[0] - exact).max() / 24.0
    assert row["error_max"] == pytest.approx(expected, abs=2e-8)


def test_a_tighter_tolerance_has_the_smaller_error_and_an_estimate_that_covers_it(scenes):
    found = [Method("ours", f"{t:g}", solver("multipole", t), 4) for t in (1e-2, 1e-4, 1e-6)]
    seen = []
    table = time_against_error(
        {"dense": scenes}, found, repeats=1, progress=lambda *p: seen.append(p)
    )
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert (table["scenes"] == 4).all()
    assert table["error_max"].is_monotonic_decreasing
    assert (table["error_max"] <= [1e-2, 1e-4, 1e-6]).all()
    assert (table["covered"] >= 0.75).all()
    assert (table["milliseconds"] > 0.0).all()


def test_both_methods_of_the_solver_are_within_their_tolerances(scenes):
    own = [m for m in methods([1e-2, 1e-3, 1e-6], 2, 1) if m.setting.startswith("tolerance ")]
    table = time_against_error({"dense": scenes}, own, repeats=1)
    tolerance = table["setting"].str.removeprefix("tolerance ").astype(float)
    within = table.assign(within=table["error_max"] <= tolerance).groupby("method")["within"]
    assert within.all().to_dict() == {
        "multipoles": True, "boundary elements": True, "fundamental solutions": True,
    }  # fmt: skip
    assert within.size().to_dict() == {
        "multipoles": 3, "boundary elements": 2, "fundamental solutions": 1,
    }  # fmt: skip


def test_cost_against_spheres_reports_the_slope_that_its_times_have():
    table = time_against_spheres([4, 8, 12, 16], [1e-2, 1e-5], 1e-2, repeats=1)
    assert len(table) == 8
    for _, own in table.groupby("volume_fraction"):
        many = own[own["spheres"] >= 8]
        slope = np.polyfit(np.log(many["spheres"]), np.log(many["milliseconds"]), 1)[0]
        assert own["exponent"].to_numpy() == pytest.approx(slope)
    assert (table["plan_milliseconds"] > 0.0).all()
    assert (table["error_estimate"] < 1e-2).all()
    assert set(table["status"]) == {"converged"}
