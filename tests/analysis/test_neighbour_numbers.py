"""Averages of runs with other numbers of neighbours stand beside the paper's points."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.neighbour_numbers import neighbour_numbers_table


def run(neighbours, phi, mean):
    time = 0.1 * np.arange(600)
    noise = np.random.default_rng(neighbours).normal(size=time.size)
    # Before the window the cloud is elsewhere.
    velocity = np.where(time < 30, 0.0, mean) + 1e-3 * noise
    return xr.Dataset(
        {"time": ("step", time), "settling_velocity_mean": ("step", velocity)},
        attrs={
            "model": "rotne_prager", "n": 1000, "volume_fraction": phi, "galileo": 0.078,
            "neighbours": neighbours,
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


def test_no_runs_are_refused():
    with pytest.raises(ValueError, match="at least one series"):
        neighbour_numbers_table([], 30.0)
