"""Steady-state means with intervals, what is not steady, and tables of time series and paths."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.settling import (
    DRIFTING,
    SHARED_NEIGHBOURS,
    STEADY,
    TOO_SHORT,
    inverse_beta_table,
    settling_in_time,
    steadiness,
    steady_state,
    tracked_trajectories,
)
from tests.analysis.series import autoregressive

BOTH = ("settling_velocity_mean", "inverse_beta_mean")


def run(seed=0, phi=1e-3, n=1000, galileo=0.078, steps=401, mean=1.4, variance=0.02):
    rng = np.random.default_rng([seed, n])
    time = 0.25 * np.arange(steps)
    velocity = mean + 0.01 * autoregressive(rng, steps, 8)
    position = np.cumsum(rng.normal(size=(steps, 3, 3)) - [0, 0, 2], axis=0) + 50
    return xr.Dataset(
        {
            "time": ("step", time),
            "settling_velocity_mean": ("step", velocity),
            "settling_velocity_variance": ("step", np.full(steps, variance)),
            "inverse_beta_mean": ("step", velocity + 0.05),
            "new_neighbours": ("step", rng.uniform(0, 0.01, steps)),
            "tracked_position": (("step", "tracked", "spatial"), position),
        },
        attrs={
            "model": "idnn",
            "n": n,
            "volume_fraction": phi,
            "galileo": galileo,
            "stokes_number": 9.0,
            "stream": seed,
        },
    )


def rising(seed=0, by=0.1, **changes):
    """A run whose mean velocity rises by `by` from 50 to 100 tau."""
    series = run(seed, **changes)
    series["settling_velocity_mean"] += by * (series["time"] / 50 - 1)
    return series


def window(series):
    return series.isel(step=series["time"].values >= 50)


def test_the_mean_is_that_of_all_steps_from_the_start_of_the_statistics():
    series = run()
    expected = series["settling_velocity_mean"].values[series["time"].values >= 50].mean()
    (row,) = steady_state([series], 50.0).to_dict("records")
    assert row["value"] == pytest.approx(expected, rel=1e-15)
    assert row["low"] < row["value"] < row["high"]
    assert steady_state([series], np.int64(50)).equals(steady_state([series], 50.0))
    assert (row["model"], row["n"], row["runs"]) == ("idnn", 1000, 1)


def test_a_case_whose_mean_or_variance_changes_along_its_window_is_not_steady():
    assert steadiness([window(run())])[0] == STEADY
    assert steadiness([window(rising())])[0] == DRIFTING
    spreading = run()
    spreading["settling_velocity_variance"] = 0.02 * (1 + spreading["time"] / 100)
    assert steadiness([window(spreading)])[0] == DRIFTING
    # Opposite drifts of two runs are the scatter between starts, no drift of the case.
    falling = rising()
    falling["settling_velocity_mean"] = 2.8 - falling["settling_velocity_mean"]
    assert steadiness([window(falling)])[0] == DRIFTING
    assert steadiness([window(rising()), window(falling)])[0] == STEADY


def test_a_drift_too_small_for_one_run_is_found_in_many():
    runs = [window(rising(seed, by=0.01)) for seed in range(30)]
    alone = [steadiness([one])[0] for one in runs]
    assert alone.count(DRIFTING) < 15
    assert steadiness(runs)[0] == DRIFTING


def test_steady_runs_are_rarely_taken_for_drifting_ones():
    found = [steadiness([window(run(seed))])[0] for seed in range(120)]
    assert found.count(DRIFTING) < 14


def test_a_cloud_that_keeps_its_random_start_is_not_steady_however_even_its_mean():
    # Spacing 37.4 d_p, and 0.02 v_s times 9 d_p/tau over 50 tau: a quarter of it.
    status, spacings = steadiness([window(run(phi=1e-5, variance=0.02**2))])
    assert status == TOO_SHORT
    assert spacings == pytest.approx(0.02 * 9 * 50 / 37.41, rel=1e-3)
    assert steadiness([window(run(phi=1e-5, variance=0.0))])[0] == STEADY


def test_a_cloud_of_one_velocity_is_steady_once_that_no_longer_changes():
    falling = run(variance=0.0)
    falling["settling_velocity_mean"] = 1 - np.exp(-falling["time"] / 50)
    assert steadiness([window(falling)])[0] == DRIFTING
    falling["settling_velocity_mean"] = 1 - np.exp(-falling["time"])
    assert steadiness([window(falling)])[0] == STEADY


def test_what_is_not_steady_has_a_trend_and_an_end_and_no_average():
    (row,) = steady_state([rising()], 50.0).to_dict("records")
    assert row["status"] == DRIFTING
    assert np.isnan([row[c] for c in ("value", "low", "high", "standard_error")]).all()
    assert row["drift"] == pytest.approx(0.1, abs=4 * row["drift_error"])
    assert row["drift_error"] < 0.02
    assert row["end"] == pytest.approx(1.5, abs=0.02)


def test_a_frozen_cloud_is_one_draw_of_its_particles_however_long_it_runs():
    frozen = run(variance=0.04)
    frozen["settling_velocity_mean"][:] = 1.1
    (row,) = steady_state([frozen], 50.0).to_dict("records")
    assert row["standard_error"] == pytest.approx(SHARED_NEIGHBOURS * np.sqrt(0.04 / 1000))


def test_several_seeds_give_the_spread_between_them():
    means = [1.30, 1.35, 1.45, 1.50]
    table = steady_state([run(seed, mean=m) for seed, m in enumerate(means)], 50.0)
    (row,) = table.to_dict("records")
    assert row["runs"] == 4
    assert row["standard_error"] == pytest.approx(np.std(means, ddof=1) / 2, rel=0.1)
    (two,) = steady_state([run(0), run(1)], 50.0).to_dict("records")
    (one,) = steady_state([run(0)], 50.0).to_dict("records")
    assert two["standard_error"] < one["standard_error"]


def test_other_quantities_and_cases_each_have_their_row():
    runs = [run(phi=1e-3), run(phi=1e-5, variance=1.0), run(phi=1e-3, galileo=0.156)]
    table = steady_state(runs, 50.0, ["new_neighbours"])
    assert table[["volume_fraction", "galileo"]].to_numpy().tolist() == [
        [1e-5, 0.078],
        [1e-3, 0.078],
        [1e-3, 0.156],
    ]
    assert table["value"].between(0.004, 0.006).all()


def test_inverse_beta_table_takes_the_lowest_galileo_number_and_the_end_where_nothing_is_steady():
    runs = [
        run(galileo=0.156, mean=2.0),
        run(galileo=0.078, mean=1.4),
        rising(phi=1e-4, variance=0.2),
    ]
    table = inverse_beta_table(steady_state(runs, 50.0, BOTH))
    simulation = table[table["source"] == "simulation"].set_index("volume_fraction")
    assert simulation["status"].to_dict() == {1e-4: DRIFTING, 1e-3: STEADY}
    assert simulation.loc[1e-3, "value"] == pytest.approx(1.4, abs=0.02)
    assert simulation.loc[1e-4, "value"] == pytest.approx(1.5, abs=0.02)
    assert np.isnan(simulation.loc[1e-4, "low"])
    start = table[table["source"] == "random start"].set_index("volume_fraction")["value"]
    assert start[1e-3] == runs[1]["inverse_beta_mean"].values[0]
    with pytest.raises(ValueError, match="empty"):
        inverse_beta_table(steady_state(runs, 50.0).iloc[:0])


def test_the_papers_values_are_bounds_where_its_arrows_stop_short():
    table = inverse_beta_table(steady_state([run()], 50.0, BOTH))
    paper = table[table["source"] == "paper"].set_index("volume_fraction")
    assert paper["relation"].to_dict() == {1e-3: ">=", 1e-4: "=", 1e-5: "="}


def test_time_series_keep_first_and_last_step_and_the_lowest_galileo_number_and_seed():
    runs = [run(seed=3), run(seed=2), run(seed=1, galileo=0.3), run(phi=1e-6)]
    table = settling_in_time(runs, points=50)
    assert len(table) == 100
    dense = table[table["volume_fraction"] == 1e-3]
    assert set(dense["seed"]) == {2}
    assert dense["time"].iloc[[0, -1]].tolist() == [0, 100]


def test_paths_are_displacements_from_the_first_step():
    series = run()
    table = tracked_trajectories([series], points=40)
    assert len(table) == 3 * 40
    path = table[table["particle"] == 2]
    position = series["tracked_position"].values[:, 1]
    np.testing.assert_array_equal(path[["x", "y", "z"]].iloc[-1], position[-1])
    np.testing.assert_array_equal(path[["dx", "dy", "dz"]].iloc[-1], position[-1] - position[0])


def test_bad_series_are_refused():
    with pytest.raises(ValueError, match="at least one is needed"):
        steady_state([], 50.0)
    with pytest.raises(ValueError, match="ends at 100"):
        steady_state([run()], 200.0)
    with pytest.raises(ValueError, match="no variable 'lift'"):
        steady_state([run()], 50.0, ["lift"])
    with pytest.raises(ValueError, match="at least 10 values"):
        steady_state([run()], 99.9)
    nameless = run()
    del nameless.attrs["galileo"]
    with pytest.raises(ValueError, match="'galileo'"):
        steady_state([nameless], 50.0)
    unmeasured = run()
    del unmeasured.attrs["stokes_number"]
    with pytest.raises(ValueError, match="'stokes_number'"):
        steady_state([unmeasured], 50.0)
    with pytest.raises(ValueError, match="two steps"):
        tracked_trajectories([run().isel(step=[0])])
    with pytest.raises(ValueError, match="at least one series"):
        settling_in_time([])
