"""Steady-state means with intervals, and the tables of time series and paths."""

import numpy as np
import pytest
import xarray as xr
from scipy import signal

from dustfall.analysis.settling import (
    SHARED_NEIGHBOURS,
    correlation_length,
    inverse_beta_table,
    mean_with_interval,
    settling_in_time,
    steady_state,
    tracked_trajectories,
)


def autoregressive(rng, m, memory):
    """A stationary first-order autoregressive series of unit variance."""
    a = np.exp(-1 / memory)
    noise = np.sqrt(1 - a**2) * rng.normal(size=m)
    return signal.lfilter([1], [1, -a], noise, zi=[a * rng.normal()])[0]


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
            "new_neighbours": ("step", rng.uniform(0, 0.01, steps)),
            "tracked_position": (("step", "tracked", "spatial"), position),
        },
        attrs={"model": "idnn", "n": n, "volume_fraction": phi, "galileo": galileo, "seed": seed},
    )


def test_correlation_length_of_an_autoregressive_series():
    a = np.exp(-1 / 10)
    series = autoregressive(np.random.default_rng(1), 200_000, 10)
    assert correlation_length(series) == pytest.approx((1 + a) / (1 - a), rel=0.05)
    assert correlation_length(np.random.default_rng(2).normal(size=10_000)) < 1.2
    assert correlation_length(np.ones(50)) == 1


@pytest.mark.parametrize("memory", [1e-3, 20.0])
def test_intervals_hold_the_true_mean_as_often_as_they_say(memory):
    rng = np.random.default_rng(int(memory) + 1)
    held = 0
    for _ in range(400):
        mean = mean_with_interval(autoregressive(rng, 2000, memory))
        held += abs(mean.value) < mean.half_width
    assert 0.91 < held / 400 < 0.98


def test_a_series_taken_for_independent_would_have_too_narrow_an_interval():
    series = autoregressive(np.random.default_rng(5), 2000, 20)
    assert mean_with_interval(series).standard_error > 3 * series.std() / np.sqrt(2000)


def test_the_mean_is_that_of_all_steps_from_the_start_of_the_statistics():
    series = run()
    expected = series["settling_velocity_mean"].values[series["time"].values >= 50].mean()
    (row,) = steady_state([series], 50.0).to_dict("records")
    assert row["value"] == pytest.approx(expected, rel=1e-15)
    assert row["low"] < row["value"] < row["high"]
    assert (row["model"], row["n"], row["runs"]) == ("idnn", 1000, 1)


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
    runs = [run(phi=1e-3), run(phi=1e-5), run(phi=1e-3, galileo=0.156)]
    table = steady_state(runs, 50.0, "new_neighbours")
    assert table[["volume_fraction", "galileo"]].to_numpy().tolist() == [
        [1e-5, 0.078],
        [1e-3, 0.078],
        [1e-3, 0.156],
    ]
    assert table["value"].between(0.004, 0.006).all()


def test_inverse_beta_table_holds_simulation_and_references_at_the_lowest_galileo_number():
    steady = steady_state([run(galileo=0.156, mean=2.0), run(galileo=0.078, mean=1.4)], 50.0)
    table = inverse_beta_table(steady)
    (ours,) = table[table["source"] == "simulation"].to_dict("records")
    assert ours["value"] == pytest.approx(1.4, abs=0.02)
    value = table.set_index(["source", "volume_fraction"])["value"]
    assert value["paper", 1e-3] == 1.39
    assert value["random start", 1e-3] == 1.458
    assert value["Del Bello 2017", 1e-3] == 4
    batchelor = table[table["source"] == "Batchelor 1972"]
    assert batchelor["value"].iloc[-1] == pytest.approx(1 - 6.55e-3)
    with pytest.raises(ValueError, match="empty"):
        inverse_beta_table(steady.iloc[:0])


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
    with pytest.raises(ValueError, match="at least one series"):
        steady_state([], 50.0)
    with pytest.raises(ValueError, match="ends at 100"):
        steady_state([run()], 200.0)
    with pytest.raises(ValueError, match="no variable 'lift'"):
        steady_state([run()], 50.0, "lift")
    with pytest.raises(ValueError, match="at least 10 values"):
        steady_state([run()], 99.9)
    nameless = run()
    del nameless.attrs["galileo"]
    with pytest.raises(ValueError, match="'galileo'"):
        steady_state([nameless], 50.0)
    with pytest.raises(ValueError, match="value 3 is not finite"):
        mean_with_interval(np.array([1, 2, 3, np.nan] * 4))
    with pytest.raises(ValueError, match="two steps"):
        tracked_trajectories([run().isel(step=[0])])
    with pytest.raises(ValueError, match="at least one series"):
        settling_in_time([])
