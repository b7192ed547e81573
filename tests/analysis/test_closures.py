"""Closures are compared in the same window, each under its own name and in its own box."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.closures import closures_table
from dustfall.analysis.voronoi import cell_volumes
from dustfall.units import SPHERE_VOLUME

START = 5.0


def cloud(model, n, spread, phi=1e-3, seed=1):
    """A random cloud, another at each frame, whose particles have fresh velocities at each."""
    rng = np.random.default_rng([seed, n])
    length = (n * SPHERE_VOLUME / phi) ** (1 / 3)
    time = np.arange(21.0)
    velocity = np.zeros((len(time), n, 3))
    velocity[:, :, 2] = -1.4 - spread * rng.normal(size=(len(time), n))
    attributes = {
        "model": model, "n": n, "volume_fraction": phi, "galileo": 0.078, "stokes_number": 9.0,
    }  # fmt: skip
    vectors = ("frame", "atom", "spatial")
    trajectory = xr.Dataset(
        {
            "time": ("frame", time),
            "coordinates": (vectors, rng.random((len(time), n, 3)) * length),
            "velocities": (vectors, velocity),
            "cell_lengths": (("frame", "cell_spatial"), np.full((len(time), 3), length)),
        },
        attrs=attributes,
    )
    series = xr.Dataset(
        {
            "time": ("step", time),
            "settling_velocity_mean": ("step", -velocity[:, :, 2].mean(axis=1)),
            "settling_velocity_variance": ("step", velocity[:, :, 2].var(axis=1)),
        },
        attrs=attributes,
    )
    return series, trajectory, cell_volumes(trajectory, START)


def table(*clouds):
    return closures_table(*(list(part) for part in zip(*clouds, strict=True)), START, seed=1)


def test_each_panel_has_each_cloud_once_in_its_own_box():
    found = table(
        cloud("idnn", 100, 0.1), cloud("idnn", 300, 0.1), cloud("all_particles", 100, 0.3)
    )
    assert list(found["panel"].unique()) == ["mean", "variance", "voronoi", "pairs", "spectrum"]
    for _, rows in found.groupby("panel"):
        assert len(rows[["model", "n"]].drop_duplicates()) == 3
    boxes = found.drop_duplicates("n").set_index("n")["box"]
    assert boxes[300] / boxes[100] == pytest.approx(3 ** (1 / 3))


def test_panels_hold_what_the_clouds_are_made_of():
    found = table(cloud("idnn", 300, 0.1), cloud("all_particles", 300, 0.3))
    mean = found[found["panel"] == "mean"]
    assert mean["y"].mean() == pytest.approx(1.4, abs=0.02)
    variance = found[found["panel"] == "variance"].groupby("model")["y"].mean()
    assert variance["all_particles"] / variance["idnn"] == pytest.approx(9, rel=0.1)
    pairs = found[(found["panel"] == "pairs") & (found["x"] > 5)]
    assert pairs["y"].mean() == pytest.approx(1, abs=0.05)
    # White noise: the spectrum of one is nine times that of the other at every wavenumber.
    spectrum = found[found["panel"] == "spectrum"].groupby("model")["y"].mean()
    assert spectrum["all_particles"] / spectrum["idnn"] == pytest.approx(9, rel=0.15)


def test_another_volume_fraction_is_refused():
    with pytest.raises(ValueError, match="one volume fraction"):
        table(cloud("idnn", 100, 0.1), cloud("idnn", 100, 0.1, phi=1e-4))
