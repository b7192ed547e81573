"""Closures compared: pairs are counted through the faces, averages begin where they are told to."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.moving_neighbours import moving_neighbours_table


def run(closure, coordinates):
    time = np.arange(40.0)
    attrs = {"closure": closure, "model": closure, "n": 3, "volume_fraction": 1e-3}
    attrs |= {"galileo": 0.078, "step": 1.0, "stokes_number": 9.0, "seed": 1}
    series = {
        "time": ("step", time),
        "settling_velocity_mean": ("step", np.where(time < 20.0, 9.0, 1.5)),
        "settling_velocity_variance": ("step", np.where(time < 20.0, 9.0, 0.02)),
        "overlaps": ("step", np.where(time < 20.0, 9.0, 2.0)),
    }
    frames = {
        "time": ("frame", [0.0, 39.0]),
        "coordinates": (("frame", "atom", "spatial"), [np.zeros((3, 3)), coordinates]),
        "cell_lengths": (("frame", "cell_spatial"), np.full((2, 3), 10.0)),
    }
    return xr.Dataset(series, attrs=attrs), xr.Dataset(frames)


def test_pairs_are_counted_through_the_faces_and_after_the_start():
    apart = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]]
    close = [[0.02, 0.0, 0.0], [29.0, 0.0, 0.0], [-1e-18, 5.0, 0.0]]
    table = moving_neighbours_table([run("one", apart), run("two", close)], 20.0)
    assert list(table["closure"]) == ["one", "two"]
    assert list(table["close_pairs"]) == [0.0, 1.0]
    assert table["velocity"].to_numpy() == pytest.approx(1.5)
    assert table["variance"].to_numpy() == pytest.approx(0.02)
    assert table["overlaps"].to_numpy() == pytest.approx(2.0)
    with pytest.raises(ValueError, match="statistics start at 50"):
        moving_neighbours_table([run("one", apart)], 50.0)
