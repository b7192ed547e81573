"""Rank correlation and R^2 against known answers."""

import numpy as np
import pytest

from dustfall.analysis.correlations import (
    coefficient_of_determination,
    predictions_against_target,
    spearman_by_neighbours,
)
from dustfall.forces.frames import spherical_coordinates


def directions(rng, m):
    v = rng.normal(size=(m, 5, 3))
    return v / np.linalg.norm(v, axis=2, keepdims=True)


def stokeslet_scenes(m=6000, seed=2):
    """Scenes of the paper's radial law with the force of superposed Stokeslets."""
    rng = np.random.default_rng([seed, m])
    d5 = (15 / (24 * 10 ** rng.uniform(-8, -3, m))) ** (1 / 3)
    r = np.sort(1 + (d5[:, None] - 1) * rng.uniform(size=(m, 5)), axis=1)
    e = directions(rng, m)
    # u = -(3 a / 4 r) (1 + e e) . e_y with a = 1/2, the slowing of the fluid by each fixed sphere.
    slowing = (0.375 / r)[..., None] * (np.array([0, 1, 0]) + e * e[..., 1:2])
    return r[..., None] * e, 24 * (np.array([0, 1, 0]) - slowing.sum(axis=1))


def test_each_neighbour_has_its_own_rank_correlation_which_no_monotone_scale_changes():
    rng = np.random.default_rng(8)
    neighbours = rng.normal(size=(400, 5, 3))
    force = rng.normal(size=(400, 3))
    # The vertical force falls with the azimuth of the third neighbour, and with nothing else.
    force[:, 2] = -np.exp(spherical_coordinates(neighbours)[:, 2, 1])
    table = spearman_by_neighbours(neighbours, force)
    rows = table[(table["coordinate"] == "azimuthal") & (table["component"] == "vertical")]
    alone = rows["rho_of_neighbour"].to_numpy()
    assert alone[2] == pytest.approx(-1)
    assert np.abs(np.delete(alone, 2)).max() < 0.2
    np.testing.assert_allclose(rows["rho"] * [1, 2, 3, 4, 5], np.abs(alone).cumsum())
    scaled = spearman_by_neighbours(neighbours, np.sinh(force))
    np.testing.assert_allclose(scaled["rho"], table["rho"])


def test_stokes_flow_correlates_radius_with_drag_and_azimuth_with_the_spanwise_force_only():
    table = spearman_by_neighbours(*stokeslet_scenes())
    rho = table.set_index(["component", "coordinate", "neighbours"])["rho"].sort_index()
    assert 0.93 < rho["streamwise", "radial", 1] < 0.98
    assert 0.87 < rho["streamwise", "radial", 5] < rho["streamwise", "radial", 1]
    assert 0.2 < rho["spanwise", "azimuthal", 1] < 0.32
    assert rho["spanwise", "azimuthal", 5] < 0.5 * rho["spanwise", "azimuthal", 1]
    rest = rho.drop([("streamwise", "radial"), ("spanwise", "azimuthal")])
    assert rest.max() < 0.05


def test_independent_data_show_the_noise_level():
    rng = np.random.default_rng(9)
    neighbours, force = directions(rng, 2000) * 4, rng.normal(size=(2000, 3))
    table = spearman_by_neighbours(neighbours + 0.01 * force[:, None], force, "cartesian")
    assert set(table["coordinates"]) == {"cartesian"}
    independent = spearman_by_neighbours(neighbours, force, "cartesian")
    ratio = independent["rho_of_neighbour"].abs().mean() / independent["noise"].iloc[0]
    assert 0.7 < ratio < 1.3


def test_spearman_refuses_what_has_no_rank():
    neighbours, force = stokeslet_scenes(50)
    with pytest.raises(ValueError, match="3 are needed"):
        spearman_by_neighbours(neighbours[:1], force[:1])
    with pytest.raises(ValueError, match="no rank"):
        spearman_by_neighbours(neighbours, np.tile([0.0, 24.0, 0.0], (50, 1)))
    with pytest.raises(ValueError, match="polar"):
        spearman_by_neighbours(neighbours, force, "polar")
    with pytest.raises(ValueError, match="forces have shape"):
        spearman_by_neighbours(neighbours, force[:9])


def test_r2_is_one_for_the_target_zero_for_its_mean_and_negative_below():
    target = np.array([1.0, 2.0, 3.0, 6.0])
    assert coefficient_of_determination(target, target) == 1
    assert coefficient_of_determination(target, np.full(4, 3.0)) == 0
    assert coefficient_of_determination(target, target + 5) == pytest.approx(1 - 100 / 14)
    with pytest.raises(ValueError, match="no variance"):
        coefficient_of_determination(np.ones(3), np.ones(3))


def test_predictions_keep_few_points_but_the_r2_of_all():
    rng = np.random.default_rng(3)
    target = rng.normal(size=(500, 3))
    predicted = target + 0.3 * rng.normal(size=(500, 3))
    table = predictions_against_target(target, {"IDNN": predicted, "dense": 0 * target}, number=50)
    assert (table.groupby(["model", "component"]).size() == 50).all()
    lateral = table[(table["model"] == "IDNN") & (table["component"] == "lateral")]
    expected = coefficient_of_determination(target[:, [0, 2]], predicted[:, [0, 2]])
    assert lateral["r2"].unique() == pytest.approx([expected])
    assert (lateral["samples"] == 1000).all()
    with pytest.raises(ValueError, match="at least one model"):
        predictions_against_target(target, {})
    with pytest.raises(ValueError, match="IDNN have shape"):
        predictions_against_target(target, {"IDNN": predicted[:3]})
