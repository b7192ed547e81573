"""Pairs and local densities of points whose statistics are known."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.pairs import (
    local_volume_fraction,
    local_volume_fraction_table,
    pair_distribution,
    pair_distribution_table,
)
from dustfall.sedimentation import random_positions
from dustfall.units import SPHERE_VOLUME


def points(n=4000, length=30.0, seed=1):
    return np.random.default_rng(seed).random((n, 3)) * length


def cloud(positions, phi, length):
    frames = len(positions)
    return xr.Dataset(
        {
            "time": ("frame", np.arange(frames, dtype=float)),
            "coordinates": (("frame", "atom", "spatial"), positions),
            "cell_lengths": (("frame", "cell_spatial"), np.full((frames, 3), length)),
        },
        attrs={"model": "idnn", "n": positions.shape[1], "volume_fraction": phi, "galileo": 0.078},
    )


def test_random_points_have_no_preferred_distance_and_no_preferred_direction():
    density, vertical = pair_distribution(points(), 30.0, [0.0, 2.0, 4.0, 8.0, 15.0])
    assert density == pytest.approx(1.0, abs=0.02)
    assert vertical == pytest.approx(1.0, abs=0.03)


def test_all_pairs_are_counted_once_across_the_faces_of_the_cube():
    # Nearest images of two points one apart, on both sides of a face, one pair along each axis.
    for axis in range(3):
        pair = np.full((2, 3), 5.0)
        pair[0, axis], pair[1, axis] = 0.25, 9.25
        density, vertical = pair_distribution(pair + 30.0, 10.0, [0.5, 1.5, 5.0])
        shell = 4 / 3 * np.pi * (1.5**3 - 0.5**3) / 1000
        assert density.tolist() == pytest.approx([1 / shell, 0.0])
        assert vertical[0] == pytest.approx(3.0 if axis == 2 else 0.0)
        assert np.isnan(vertical[1])


def test_twins_above_each_other_double_the_first_shell_and_stand_upright():
    first = points(1000)
    both = np.concatenate([first, first + np.array([0.0, 0.0, 1.2])])
    density, vertical = pair_distribution(both, 30.0, [1.0, 1.5, 6.0])
    expected = 1000 / (2000 * 1999 / 2 * 4 / 3 * np.pi * (1.5**3 - 1) / 27_000)
    assert density[0] == pytest.approx(1 + expected, rel=0.05)
    assert vertical[0] == pytest.approx((1 + 3 * expected) / (1 + expected), rel=0.05)
    assert vertical[1] == pytest.approx(1.0, abs=0.1)


def test_random_spheres_crowd_their_fifth_neighbour_by_five_quarters():
    phi, n = 1e-4, 20_000
    positions = random_positions(np.random.default_rng(3), n, phi)
    length = (n * SPHERE_VOLUME / phi) ** (1 / 3)
    found = local_volume_fraction(positions, length)
    assert found.mean() / phi == pytest.approx(1.25, abs=0.02)


def test_tables_take_the_window_alone_and_the_start_beside_it():
    length = 30.0
    frames = np.array([points(500, length, seed) for seed in range(6)])
    frames[:3] = frames[0] / 3  # crowded in a corner before the window
    phi = 500 * SPHERE_VOLUME / length**3
    table = pair_distribution_table([cloud(frames, phi, length)], 3.0, snapshots=3)
    far = table[table["distance"] > 3]
    assert far["density"].mean() == pytest.approx(1.0, abs=0.05)
    assert (table["low"] <= table["density"]).all()
    local = local_volume_fraction_table([cloud(frames, phi, length)], [3.0], 20 * phi)
    mean = local.set_index("time")["mean"]
    assert mean["window"] == pytest.approx(1.25, abs=0.1)
    assert mean["start"] > 20
    above = local.set_index("time")["above"]
    assert above["start"] > 0.5 > above["window"]


def test_shells_beyond_half_the_cube_are_refused():
    with pytest.raises(ValueError, match="at most half the side of the cube, 5"):
        pair_distribution(points(10, 10.0), 10.0, [1.0, 6.0])
