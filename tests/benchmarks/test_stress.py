"""The stress tests measure against truths, and the solver's word on its error holds."""

from functools import partial

import numpy as np
import pytest

from dustfall.benchmarks import stress
from dustfall.spheres import checked_centres
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres


@pytest.mark.parametrize("gap", [0.3, 0.01])
def test_fine_forces_are_exact_for_a_pair(gap):
    centres = (1.0 + gap) * stress.CLUSTERS["pair"]
    exact = forces_on_two_spheres(centres, stress.FLOW)
    np.testing.assert_allclose(stress.fine_forces(centres, stress.FLOW, 40), exact, atol=1e-7)


def test_every_gap_is_within_tolerance_or_says_that_it_is_not(monkeypatch):
    monkeypatch.setattr(stress, "FINE_DEGREE", 40)
    table = stress.gaps((1e-2, 1e-4), sizes=(1.0, 0.1, 1e-2))
    assert len(table) == len(stress.CLUSTERS) * 2 * 3
    assert (table["error"] <= table["estimate"]).all()
    assert (table["status"] == "converged").all()
    assert (table["error"] <= table["tolerance"]).all()


def test_no_crowd_fools_the_error_estimate(monkeypatch):
    monkeypatch.setattr(stress, "FINE_DEGREE", 40)
    monkeypatch.setattr(stress, "PEER_SPHERES", 0)
    monkeypatch.setattr(stress, "LURES", stress.LURES[:3])
    few = {
        name: stress.FAMILIES[name] for name in stress.FAMILIES if "far" in name or "lure" in name
    }
    few["lattice of 125"] = (1.0, partial(stress._lattice, side=5, spacings=(60.0, 60.0)))
    monkeypatch.setattr(stress, "FAMILIES", few)
    table = stress.crowds((1e-3, 1e-4, 1e-5), number=1)
    assert len(table) == 3 * (3 + len(few))
    converged = table["status"] == "converged"
    assert converged.all()
    assert (table["error"] <= table["tolerance"]).all()
    assert (table["error"] <= table["estimate"]).all()


@pytest.mark.parametrize("name", stress.FAMILIES)
def test_scenes_of_every_family_are_drawn_without_contact_and_again(name):
    _, scene = stress.FAMILIES[name]
    centres, again, other = (scene(np.random.default_rng(seed)) for seed in (1, 1, 2))
    checked_centres(centres)
    np.testing.assert_array_equal(centres, again)
    assert not np.array_equal(centres, other)


def test_a_method_that_shares_no_code_agrees_with_what_crowds_are_measured_against(monkeypatch):
    monkeypatch.setattr(stress, "LURES", ())
    scene = np.array([[0.0, 0.0, 0.0], [1.3, 0.2, 0.0], [0.0, 5.0, 3.0]])
    monkeypatch.setattr(stress, "FAMILIES", {"three": (1.0, lambda rng: scene)})
    row = stress.crowds((1e-4,), number=1).iloc[0]
    assert row["spheres"] == 3
    assert row["difference"] <= row["peer_estimate"] <= 1e-7


def test_pairs_far_apart_are_exact_to_the_tolerance():
    table = stress.distances((1e-4, 1e-8), values=(10.0, 1e4))
    assert (table["error"] <= table["tolerance"]).all()


def test_place_turn_and_nearly_equal_distances_change_nothing():
    table = stress.invariances((1e-4,), gap=0.1)
    # Rounding may choose other degrees; forces change by a hundredth of the tolerance at most.
    assert (table["error"] <= 0.01 * table["tolerance"]).all()


def test_the_answer_does_not_know_how_the_mesh_is_turned():
    assert stress.turned_mesh(0.7)["error"].iloc[0] < 1e-13


def test_condition_of_the_system_grows_as_the_gap_closes():
    table = stress.condition_numbers(edges=(1.0,), sizes=(1.0, 0.1, 0.01), degree=6)
    system = table[table["test"] == "condition, system"]["condition"]
    assert system.is_monotonic_increasing
    assert system.iloc[0] < 3.0
