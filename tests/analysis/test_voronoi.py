"""Voronoï cells: they fill the box, random points have their known variance, laws are laws."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats
from scipy.spatial import ConvexHull
from scipy.spatial import Voronoi as ScipyVoronoi

from dustfall.analysis.references import MATCHED_GAMMA, POISSON_VORONOI_VARIANCE
from dustfall.analysis.settling import CASE
from dustfall.analysis.voronoi import (
    block_bootstrap,
    cell_volumes,
    pooled_volumes,
    random_sphere_table,
    random_sphere_variance,
    volume_distribution,
    volume_variance,
    voronoi_pdf_table,
    voronoi_variance_table,
    voronoi_volumes,
)


def random_points(n, length=1.0, seed=1):
    return np.random.default_rng([seed, n]).uniform(0, length, (n, 3))


def trajectory(galileo=0.078, frames=6, n=60, length=10.0, drift=500.0, seed=1):
    rng = np.random.default_rng([seed, frames, n])
    start = rng.uniform(0, length, (n, 3))
    steps = rng.normal(size=(frames, n, 3)) - [0, 0, drift]
    return xr.Dataset(
        {
            "time": ("frame", 20.0 * np.arange(frames)),
            "coordinates": (("frame", "atom", "spatial"), start + np.cumsum(steps, axis=0)),
            "cell_lengths": (("frame", "cell_spatial"), np.full((frames, 3), length)),
        },
        attrs={"model": "idnn", "n": n, "volume_fraction": 1e-3, "galileo": galileo, "seed": seed},
    )


@pytest.mark.parametrize("lengths", [(1.0, 1.0, 1.0), (3741.0, 3741.0, 3741.0), (1.0, 2.0, 5.0)])
def test_cells_fill_the_box(lengths):
    volumes = voronoi_volumes(random_points(500) * lengths, lengths)
    assert volumes.sum() == pytest.approx(np.prod(lengths), rel=1e-6)
    assert (volumes > 0).all()


def test_unwrapped_positions_have_the_cells_of_wrapped_ones():
    points = random_points(200, 10.0)
    images = points + 10.0 * np.random.default_rng(2).integers(-90, 90, points.shape)
    expected = voronoi_volumes(points, 10.0)
    np.testing.assert_allclose(voronoi_volumes(images, 10.0), expected, rtol=1e-4)


def test_a_lattice_has_equal_cells():
    grid = np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3) + 0.5
    np.testing.assert_allclose(voronoi_volumes(grid, 5.0), 1.0, rtol=1e-6)


def test_volumes_are_those_of_an_independent_tessellation_with_images():
    points = random_points(120)
    shifts = np.stack(np.meshgrid(*[[0, -1, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    images = (points + shifts[:, None]).reshape(-1, 3)
    cells = ScipyVoronoi(images)
    expected = [
        ConvexHull(cells.vertices[cells.regions[cells.point_region[i]]]).volume for i in range(120)
    ]
    np.testing.assert_allclose(voronoi_volumes(points, 1.0), expected, rtol=1e-4)


def test_random_points_have_variance_0_179_within_the_interval():
    volumes = np.array([voronoi_volumes(random_points(1000, seed=s), 1.0) for s in range(25)])
    found = volume_variance(volumes / volumes.mean(axis=1, keepdims=True), seed=1)
    assert found["low"] < POISSON_VORONOI_VARIANCE < found["high"]
    assert found["high"] - found["low"] < 0.03
    assert found["value"] == pytest.approx(POISSON_VORONOI_VARIANCE, abs=0.01)


def test_snapshots_of_a_frozen_cloud_count_once():
    volumes = voronoi_volumes(random_points(500), 1.0) * 500
    once = volume_variance(volumes, seed=1)
    often = volume_variance(np.tile(volumes, (40, 1)), seed=1)
    assert often == pytest.approx(once)
    assert once["low"] < once["value"] < once["high"]


def test_volume_density_integrates_to_one_and_follows_the_matched_gamma_law():
    volumes = np.array([voronoi_volumes(random_points(2000, seed=s), 1.0) for s in range(5)]) * 2000
    table = volume_distribution(volumes, seed=1)
    assert table["density"].sum() * 0.1 == pytest.approx(1, abs=1e-3)
    shape, scale = MATCHED_GAMMA
    law = stats.gamma.pdf(table["volume"], shape, scale=scale)
    assert np.abs(table["density"] - law).max() < 0.08
    assert (table["low"] <= table["density"]).all()
    assert (table["density"] <= table["high"]).all()


def test_block_bootstrap_has_the_textbook_width_and_none_of_one_block():
    x = np.random.default_rng(6).normal(size=400)
    low, high = block_bootstrap(x, seed=1)
    assert (high - low) / (2 * 1.96 * x.std() / 20) == pytest.approx(1, abs=0.1)
    assert np.isnan(block_bootstrap(x[:3], seed=1, length=2.0)).all()


def cells(start=0.0, **changes):
    return cell_volumes(trajectory(**changes), start)


def test_first_frame_and_snapshots_in_time_are_measured_and_volumes_normalised():
    seen = []
    run = trajectory()
    found = cell_volumes(run, 40.0, snapshots=2, progress=lambda *a: seen.append(a))
    assert found["volume"].shape == (3, 60)
    assert found["time"].values.tolist() == [0.0, 40.0, 100.0]
    np.testing.assert_allclose(found["volume"].mean("atom"), 1)
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert found.attrs == run.attrs
    with pytest.raises(ValueError, match="no frame lies at or after 300"):
        cell_volumes(run, 300.0)


def test_pdf_table_names_galileo_numbers_as_multiples_of_the_lowest():
    table = voronoi_pdf_table([cells(galileo=0.312), cells(galileo=0.078)], seed=1)
    assert table["source"].unique().tolist() == [
        "random start",
        "settling",
        "gamma, k = 5, theta = 0.2",
        "gamma, k = 5.59",
    ]
    assert table["galileo_multiple"].dropna().unique().tolist() == [1.0, 4.0]


def test_variance_table_stands_beside_the_settling_velocity_of_the_same_case():
    case = dict(zip(CASE, ("idnn", 60, 1e-3, 0.078), strict=True))
    found = {"status": "steady", "value": 1.4, "low": 1.3, "high": 1.5, "end": 1.6}
    steady = pd.DataFrame([case | found])
    spheres = random_sphere_table([1e-3], seed=1, particles=100)
    table = voronoi_variance_table([cells()], steady, spheres, seed=1)
    assert set(table["source"]) == {"simulation", "random spheres", "random points", "paper"}
    ours = table[table["source"] != "paper"].set_index("source")
    assert (ours["inverse_beta"] == 1.4).all()
    assert ours.loc["random points", "variance"] == pytest.approx(0.89516)
    found = pooled_volumes([cells()]).var(axis=1).mean()
    assert ours.loc["simulation", "variance"] == pytest.approx(found / 0.2)
    drifting = steady.assign(status="drifting", value=np.nan, low=np.nan, high=np.nan)
    later = voronoi_variance_table([cells()], drifting, spheres, seed=1).set_index("source")
    assert later.loc["simulation", "inverse_beta"] == 1.6
    last = pooled_volumes([cells()], slice(-1, None))
    assert last.shape == (1, 60)
    assert later.loc["simulation", "variance"] == pytest.approx(last.var() / 0.2)
    expected = random_sphere_variance(1e-3, 100, seed=1)
    assert ours.loc["random spheres", "high"] == pytest.approx(expected["high"] / 0.2)
    with pytest.raises(ValueError, match="steady states has no row for"):
        voronoi_variance_table([cells(galileo=0.3)], steady, spheres, seed=1)
    with pytest.raises(ValueError, match="random spheres has no row for phi"):
        voronoi_variance_table([cells()], steady, spheres[:0], seed=1)
    close = spheres.assign(volume_fraction=1e-3 + 1e-9)
    with pytest.raises(ValueError, match="random spheres has no row for phi"):
        voronoi_variance_table([cells()], steady, close, seed=1)


def test_seeds_of_a_case_are_pooled_and_narrow_the_interval():
    one = pooled_volumes([cells(seed=1)])
    two = pooled_volumes([cells(seed=1), cells(seed=2)])
    assert two.shape == (5, 120)
    np.testing.assert_array_equal(two[:, :60], one)
    width = [v["high"] - v["low"] for v in (volume_variance(one, 1), volume_variance(two, 1))]
    assert width[1] < width[0]
    pdf = voronoi_pdf_table([cells(seed=1), cells(seed=2)], seed=1)
    assert pdf["galileo_multiple"].dropna().unique().tolist() == [1.0]


def test_random_spheres_have_more_even_cells_the_denser_they_are():
    dilute = random_sphere_variance(1e-7, 1500, seed=1, clouds=6)
    assert dilute["low"] < POISSON_VORONOI_VARIANCE < dilute["high"]
    # The same draws at each volume fraction, so that differences are sharper than the intervals.
    variance = [
        random_sphere_variance(phi, 1500, seed=1, clouds=3)["value"] for phi in (1e-7, 1e-3, 1e-2)
    ]
    assert 0.96 < variance[1] / variance[0] < 1
    assert variance[2] < 0.95 * variance[1]


@pytest.mark.parametrize(
    ("points", "lengths", "match"),
    [
        (np.ones((1, 3)), 1.0, "n >= 2"),
        (np.ones((4, 2)), 1.0, "shape"),
        (np.array([[0.1, 0.2, 0.3], [np.nan, 0, 0]]), 1.0, "point 1"),
        (random_points(9), (1.0, 1.0, 0.0), "above zero"),
    ],
)
def test_bad_points_are_refused(points, lengths, match):
    with pytest.raises(ValueError, match=match):
        voronoi_volumes(points, lengths)


def test_no_cells_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        voronoi_pdf_table([], seed=1)
