"""Neighbour changes: shares of particles, and of changes in which only the fifth was replaced."""

import numpy as np
import pytest
import xarray as xr

from dustfall.analysis.neighbour_changes import neighbour_changes


def run(changes, fifth, seed=1):
    attrs = {"model": "idnn", "n": 1000, "volume_fraction": 1e-3, "galileo": 0.078}
    attrs |= {"step": 0.1, "stokes_number": 9.0}
    still = np.ones(len(changes))
    return xr.Dataset(
        {
            "time": ("step", 0.1 * np.arange(len(changes))),
            "new_neighbours": ("step", changes),
            "only_farthest": ("step", fifth),
            "settling_velocity_mean": ("step", still),
            "settling_velocity_variance": ("step", 0 * still),
        },
        attrs=attrs | {"seed": seed},
    )


def test_shares_are_of_particles_and_of_changes():
    # Steps without a change have no share of their own, and count as none.
    changes = np.tile([0.0, 0.1, 0.3], 20)
    fifth = np.tile([np.nan, 0.5, 0.9], 20)
    (row,) = neighbour_changes([run(changes, fifth)], 0.0).to_dict("records")
    assert row["share"] == pytest.approx(0.4 / 3)
    assert row["per_tau"] == pytest.approx(4 / 3)
    assert row["only_farthest"] == pytest.approx((0.1 * 0.5 + 0.3 * 0.9) / 0.4)
    assert row["low"] < row["share"] < row["high"]


def test_seeds_of_a_case_share_a_row_and_a_still_cloud_has_no_changes_to_share():
    runs = [run(np.full(40, share), np.ones(40), seed) for seed, share in ((1, 0.1), (2, 0.2))]
    (row,) = neighbour_changes(runs, 0.0).to_dict("records")
    assert row["share"] == pytest.approx(0.15)
    (still,) = neighbour_changes([run(np.zeros(40), np.full(40, np.nan))], 0.0).to_dict("records")
    assert still["share"] == 0
    assert np.isnan(still["only_farthest"])
    with pytest.raises(ValueError, match="at least one"):
        neighbour_changes([], 0.0)
