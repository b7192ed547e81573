"""Time averages: a frozen ensemble keeps its spread, an ergodic one loses it as 1/T."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.ergodicity import ergodicity_table, spread_of_time_averages


def trajectory(velocity, phi=1e-3):
    vectors = np.zeros((*velocity.shape, 3))
    vectors[:, :, 2] = -velocity
    return xr.Dataset(
        {
            "time": ("frame", 2.0 * np.arange(len(velocity))),
            "velocities": (("frame", "atom", "spatial"), vectors),
        },
        attrs={"model": "idnn", "n": velocity.shape[1], "volume_fraction": phi, "galileo": 0.078},
    )


def test_uncorrelated_velocities_lose_their_spread_as_one_over_the_window():
    velocity = np.random.default_rng(1).normal(1.4, 0.1, (64, 4000))
    table = spread_of_time_averages(velocity)
    assert table["frames"].tolist() == [1, 2, 4, 8, 16, 32, 64]
    np.testing.assert_allclose(table["spread"] * table["frames"], 1, rtol=0.06)


def test_a_frozen_ensemble_keeps_its_spread_and_drifts_in_time_do_not_count():
    own = np.random.default_rng(1).normal(1.4, 0.1, 100)
    velocity = own + np.linspace(0, 1, 21)[:, None]
    np.testing.assert_allclose(spread_of_time_averages(velocity)["spread"], 1, rtol=1e-12)


def test_the_share_lost_is_that_of_the_variance_in_time():
    rng = np.random.default_rng(1)
    velocity = rng.normal(1.4, 0.3, 3000) + rng.normal(0, 0.4, (20, 3000))
    whole = spread_of_time_averages(velocity)["spread"].iloc[-1]
    assert whole == pytest.approx((0.09 + 0.16 / 20) / 0.25, rel=0.05)


def test_table_counts_windows_in_tau_from_the_start_of_the_statistics():
    velocity = np.random.default_rng(1).normal(1.4, 0.1, (11, 50))
    table = ergodicity_table([trajectory(velocity), trajectory(velocity, 1e-5)], 6.0)
    assert table.loc[table["volume_fraction"] == 1e-3, "window"].tolist() == [2, 4, 8, 16]
    assert table["ensemble_mean"].iloc[0] == pytest.approx(velocity[3:].mean())
    with pytest.raises(ValueError, match="at least 4"):
        ergodicity_table([trajectory(velocity)], 16.0)
    with pytest.raises(ValueError, match="differ in velocity"):
        ergodicity_table([trajectory(np.ones((11, 50)))], 6.0)
