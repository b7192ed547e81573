"""Lifetimes of series whose memory is known."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.lifetimes import autocorrelation, lifetime, lifetimes_table
from dustfall.units import SPHERE_VOLUME
from tests.analysis.series import autoregressive


def test_a_first_order_series_keeps_its_memory_for_its_memory():
    rng = np.random.default_rng(1)
    values = np.array([autoregressive(rng, 80, 6) for _ in range(2000)]).T + 5.0
    correlation = autocorrelation(values)
    lag = np.arange(len(correlation))
    np.testing.assert_allclose(correlation[:20], np.exp(-lag[:20] / 6), atol=0.02)
    assert lifetime(lag, correlation) == pytest.approx(6.0, abs=0.2)


def test_what_is_never_forgotten_has_no_lifetime_and_what_is_none_is_refused():
    kept = np.tile(np.random.default_rng(2).normal(size=50), (20, 1))
    correlation = autocorrelation(kept)
    assert correlation == pytest.approx(1.0)
    assert np.isnan(lifetime(np.arange(10), correlation))
    with pytest.raises(ValueError, match="nothing to correlate"):
        autocorrelation(np.ones((20, 50)))


def test_a_cloud_that_keeps_its_places_keeps_its_crowds_and_forgets_its_velocities():
    rng, n, frames = np.random.default_rng(3), 200, 40
    length = 20.0
    places = np.tile(rng.random((n, 3)) * length, (frames, 1, 1))
    velocity = np.zeros((frames, n, 3))
    velocity[:, :, 2] = -1 - 0.1 * np.array([autoregressive(rng, frames, 4) for _ in range(n)]).T
    phi = n * SPHERE_VOLUME / length**3
    cloud = xr.Dataset(
        {
            "time": ("frame", 0.5 * np.arange(frames)),
            "coordinates": (("frame", "atom", "spatial"), places),
            "velocities": (("frame", "atom", "spatial"), velocity),
            "cell_lengths": (("frame", "cell_spatial"), np.full((frames, 3), length)),
        },
        attrs={
            "model": "idnn", "n": n, "volume_fraction": phi, "galileo": 0.078, "stokes_number": 9.0,
        },
    )  # fmt: skip
    table = lifetimes_table([cloud], 5.0).set_index("quantity")
    assert (table.loc["membership", "correlation"] > 0.999).all()
    assert np.isnan(table.loc["membership", "lifetime"]).all()
    lived = table.loc["settling velocity", ["lifetime", "lifetime_spreading"]].iloc[0]
    assert lived["lifetime"] == pytest.approx(0.5 * 4, abs=0.4)
    unit = (length**3 / n) ** (2 / 3) / 9.0
    assert lived["lifetime_spreading"] == pytest.approx(lived["lifetime"] / unit)
