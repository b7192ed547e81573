"""Distributions of the force: densities, decades, Laplace law, the figures of the summary."""

import numpy as np
import pytest
from scipy import integrate, stats

from dustfall.analysis.distributions import (
    decades,
    fit,
    force_distributions,
    force_samples,
    force_summary,
    slices,
)


def forces(m=3000, seed=1):
    rng = np.random.default_rng([seed, m])
    phi = 10 ** rng.uniform(-8, -3, m)
    lateral = rng.laplace(scale=0.25, size=(m, 2))
    streamwise = 24 * (1 - rng.uniform(0, 0.5, m))
    return phi, np.stack([lateral[:, 0], streamwise, lateral[:, 1]], axis=1)


def test_each_density_integrates_to_one():
    table = force_distributions(*forces())
    assert table.groupby(["component", "slice"]).ngroups == 18
    for _, curve in table.groupby(["component", "slice"]):
        assert integrate.trapezoid(curve["density"], curve["force"]) == pytest.approx(1, abs=2e-3)


def test_no_density_lies_above_stokes_drag_where_no_force_does():
    table = force_distributions(*forces())
    streamwise = table[table["component"] == "streamwise"]
    assert streamwise.groupby("slice")["force"].max().unique().tolist() == [24.0]
    # Uniform up to 24: the density keeps its level up to the end, which half of a kernel would not.
    at_bound = streamwise.groupby("slice").last()
    assert (at_bound["density"] > 0.7 / 12).all()


def test_density_of_normal_samples_is_the_normal_density():
    rng = np.random.default_rng(4)
    force = rng.normal(size=(20000, 3))
    table = force_distributions(np.full(20000, 2e-5), force)
    error = table["density"] - stats.norm.pdf(table["force"])
    # The kernel estimate of 20,000 samples scatters by 0.007 at the peak.
    assert np.abs(error).max() < 0.03


def test_a_long_tail_has_a_density_in_one_piece_and_a_peak_its_height():
    # Laplace of width 0.01 in nine of ten samples, of width one in the tenth.
    rng = np.random.default_rng(7)
    m = 3000
    width = np.where(np.arange(m) % 10 > 0, 0.01, 1.0)
    force = np.column_stack([width * rng.laplace(size=m), np.full(m, 20.0) + rng.normal(size=m),
                             width * rng.laplace(size=m)])  # fmt: skip
    curve = force_distributions(np.full(m, 1e-8), force).query("component == 'spanwise'")
    x, density = curve["force"].to_numpy(), curve["density"].to_numpy()
    exact = 0.9 * stats.laplace.pdf(x, scale=0.01) + 0.1 * stats.laplace.pdf(x)
    tail = (np.abs(x) > 0.3) & (np.abs(x) < 2.5)
    # Some ten samples lie under a kernel there: a value scatters by about a third.
    assert np.sqrt(np.mean(np.log(density[tail] / exact[tail]) ** 2)) < 0.5
    assert density.max() == pytest.approx(0.9 * 50, rel=0.25)


def test_the_papers_range_has_its_seven_slices():
    phi = np.logspace(-9, -3, 61)
    parts = slices(phi)
    assert [exponent for exponent, _ in parts] == list(range(-9, -2))
    assert (sum(inside.astype(int) for _, inside in parts) == 1).all()
    for exponent, inside in parts:
        assert np.abs(np.log10(phi[inside]) - exponent).max() <= 0.5 + 1e-9


def test_a_decade_holds_its_lower_end_and_the_last_one_its_upper():
    phi = np.array([1e-8, 5e-8, 1e-7, 9.9e-4, 1e-3])
    split = decades(phi)
    assert [(low, int(inside.sum())) for low, _, inside in split] == [
        (1e-8, 2),
        (1e-7, 1),
        (1e-4, 2),
    ]
    assert sum(inside.sum() for *_, inside in split) == len(phi)
    (only,) = decades(np.full(4, 1e-3))
    assert only[:2] == pytest.approx((1e-3, 1e-2))


def test_a_fit_finds_the_law_and_normal_samples_fit_worse():
    rng = np.random.default_rng(3)
    law = fit("laplace", rng.laplace(0.1, 0.3, 20000))
    assert law["location"] == pytest.approx(0.1, abs=0.01)
    assert law["scale"] == pytest.approx(0.3, rel=0.03)
    assert law["ks"] < 0.01
    assert fit("laplace", rng.normal(size=20000))["ks"] > 0.03


def test_a_fitted_law_exceeds_its_own_level_in_one_case_of_twenty():
    rng = np.random.default_rng(20)
    draws = {"laplace": rng.laplace, "normal": rng.normal}
    for law, draw in draws.items():
        found = [fit(law, draw(size=300)) for _ in range(1500)]
        # Three standard deviations of the share; at 1.36/sqrt(m) it is 0.0004.
        share = np.mean([f["ks"] > f["ks_level"] for f in found])
        assert share == pytest.approx(0.05, abs=0.017), law


def test_summary_counts_shares_below_stokes_and_keeps_the_papers_figures():
    phi = np.full(10, 3e-5)
    force = np.zeros((10, 3))
    force[:, 0] = np.arange(10)
    force[:, 2] = -np.arange(10)
    force[:, 1] = 24 * (1 - np.array([0, 0, 0, 0, 0.1, 0.1, 0.2, 0.2, 0.4, 0.5]))
    table = force_summary(phi, force)
    overall = table.drop_duplicates(["quantity", "component"]).set_index(["quantity", "component"])
    assert overall.loc[("share_15_percent_below_stokes", "streamwise"), "value"] == 0.4
    assert overall.loc[("share_34_percent_below_stokes", "streamwise"), "value"] == 0.2
    assert overall.loc[("variance", "spanwise"), "value"] == pytest.approx(8.25)
    assert overall.loc[("variance", "spanwise"), "paper"] == 0.126
    assert overall.loc[("mean", "lateral"), "value"] == pytest.approx(0)


def test_scatter_samples_depend_on_the_data_alone_and_span_the_range():
    phi, force = forces()
    table = force_samples(phi, force, number=100)
    assert (table.groupby("component").size() == 100).all()
    assert table["volume_fraction"].min() == phi.min()
    assert table["volume_fraction"].max() == phi.max()
    order = np.random.default_rng(0).permutation(len(phi))
    assert table.equals(force_samples(phi[order], force[order], number=100))
    drawn = table[table["component"] == "streamwise"]
    assert np.isin(drawn["force"], force[:, 1]).all()
    assert len(force_samples(phi[:7], force[:7])) == 21


@pytest.mark.parametrize(
    ("phi", "force", "match"),
    [
        (np.ones(3), np.ones((2, 3)), "shape"),
        (np.ones(0), np.ones((0, 3)), "no forces"),
        (np.zeros(2), np.ones((2, 3)), "above zero"),
        (np.ones(2), np.array([[0, 0, 0], [0, np.nan, 0]]), "sample 1"),
    ],
)
def test_bad_forces_are_refused(phi, force, match):
    with pytest.raises(ValueError, match=match):
        force_summary(phi, force)


def test_too_few_samples_for_a_density_are_refused():
    with pytest.raises(ValueError, match="no slice"):
        force_distributions([1e-5], [[0.0, 20.0, 0.0]])
    with pytest.raises(ValueError, match="no density"):
        force_distributions(np.full(9, 1e-5), np.tile([0.1, 20.0, 0.2], (9, 1)) + _jiggle())
    with pytest.raises(ValueError, match="two different values"):
        fit("laplace", [1.0])


def _jiggle():
    lateral = np.zeros((9, 3))
    lateral[:, [0, 2]] = np.arange(18).reshape(9, 2)
    return lateral
