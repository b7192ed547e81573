"""Averages of runs with other numbers of neighbours stand beside the paper's points."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.neighbour_numbers import neighbour_numbers_table
from dustfall.analysis.settling import STEADY, TOO_SHORT


def run(neighbours, phi, mean):
    time = 0.1 * np.arange(600)
    noise = np.random.default_rng(neighbours).normal(size=time.size)
    # Before the window the cloud is elsewhere.
    velocity = np.where(time < 30, 0.0, mean) + 1e-3 * noise
    return xr.Dataset(
        {
            "time": ("step", time),
            "settling_velocity_mean": ("step", velocity),
            "settling_velocity_variance": ("step", 0.04 + 1e-4 * noise),
        },
        attrs={
            "model": "rotne_prager", "n": 1000, "volume_fraction": phi, "galileo": 0.078,
            "neighbours": neighbours, "stokes_number": 9.0,
        },
    )  # fmt: skip


def test_the_window_alone_is_averaged_and_the_paper_has_its_relation():
    runs = [run(5, 1e-3, 1.49), run(4, 1e-3, 1.42), run(4, 1e-4, 1.18), run(5, 1e-7, 1.02)]
    table = neighbour_numbers_table(runs, 30.0)
    assert table["neighbours"].tolist() == [5, 4, 4, 5]
    expected = np.array([1.02, 1.18, 1.42, 1.49])
    assert (np.abs(table["value"] - expected) < 2 * table["half"] + 1e-4).all()
    assert (table["half"] < 1e-3).all()
    assert table["relation"].tolist() == ["", "=", ">=", ">="]
    assert np.isnan(table["paper"][0])
    # 0.2 v_s times 9 d_p/tau over 30 tau are 54 d_p: 6.7 spacings at 1e-3, and 0.3 at 1e-7.
    assert table["status"].tolist()[0] == TOO_SHORT
    assert table["status"].tolist()[2] == STEADY


def test_the_papers_window_is_averaged_beside_and_a_run_that_ends_before_has_none():
    long = run(4, 1e-3, 1.4).isel(step=slice(0, 1)).pad(step=(0, 1200), mode="edge")
    time = 0.1 * np.arange(1201)
    long = long.assign(
        time=("step", time),
        settling_velocity_mean=("step", np.where((time >= 50) & (time <= 100), 1.2, 1.4)),
    )
    table = neighbour_numbers_table([long, run(5, 1e-3, 1.49)], 0.0).set_index("neighbours")
    assert table.loc[4, "as_paper"] == pytest.approx(1.2)
    assert table.loc[4, "as_paper_half"] == pytest.approx(0, abs=1e-12)
    assert np.isnan(table.loc[5, ["as_paper", "as_paper_half"]].astype(float)).all()


def test_a_run_that_hardly_steps_in_the_papers_window_has_no_mean_over_it():
    whole = run(4, 1e-3, 1.4)
    stretched = whole.assign(time=whole["time"] * (1000 / float(whole["time"][-1])))
    inside = (stretched["time"] >= 50) & (stretched["time"] <= 100)
    assert 10 < inside.sum() < 100
    tenth = stretched.isel(step=slice(None, None, 10))
    table = neighbour_numbers_table([stretched, tenth.assign_attrs(neighbours=5)], 300.0)
    assert table["as_paper"].isna().tolist() == [False, True]


def test_each_run_may_have_a_start_of_its_own():
    runs = [run(5, 1e-3, 1.49), run(4, 1e-3, 1.42)]
    both = neighbour_numbers_table(runs, [0.0, 30.0]).set_index("neighbours")["value"]
    assert both[5] == pytest.approx(1.49 / 2, rel=0.01)
    assert both[4] == pytest.approx(1.42, rel=0.01)
    with pytest.raises(ValueError, match="1 starts of windows for 2 runs"):
        neighbour_numbers_table(runs, [30.0])


def test_no_runs_are_refused():
    with pytest.raises(ValueError, match="at least one is needed"):
        neighbour_numbers_table([], 30.0)
