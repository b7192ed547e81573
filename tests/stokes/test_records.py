"""Shards: cutting scenes otherwise changes no bit, and a record says what its numbers are."""

import h5py
import numpy as np

from dustfall.scenes import random_scenes
from dustfall.stokes.records import COLUMNS, solve_shard, write_records


def test_records_do_not_depend_on_the_shard(tmp_path):
    neighbours, _ = random_scenes(5, "uniform", range(8), (1e-4, 1e-3))
    seen = []
    whole = solve_shard(neighbours, 1e-4, lambda *progress: seen.append(progress))
    assert seen == [(k, 8) for k in range(1, 9)]
    parts = [solve_shard(neighbours[k : k + 3], 1e-4) for k in range(0, 8, 3)]
    for name in set(COLUMNS) - {"scene"}:
        np.testing.assert_array_equal(
            whole[name], np.concatenate([part[name] for part in parts]), err_msg=name
        )
    assert whole["force"].shape == (8, 6, 3)
    assert whole["error_estimate"].shape == (8, 6)
    write_records(tmp_path / "one.h5", whole, np.arange(8))
    write_records(tmp_path / "other.h5", whole, np.arange(8))
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "other.h5").read_bytes()


def test_a_record_is_readable_without_this_library(tmp_path):
    neighbours, _ = random_scenes(5, "contact", range(3), (1e-4, 1e-3))
    records = solve_shard(neighbours, 1e-4)
    write_records(tmp_path / "records.h5", records, np.arange(3))
    with h5py.File(tmp_path / "records.h5") as file:
        assert set(file["status"].asstr()[:]) == {"converged"}
        assert file["force"].attrs["units"] == "Re_p c_D"
        degrees = file["degrees"][:]
    assert degrees.shape == (3, 6, 6)
    np.testing.assert_array_equal(degrees, degrees.transpose(0, 2, 1))
    # The neighbour that nearly touches the reference sphere needs more than a far one.
    nearest, farthest = degrees[:, 0, 1], degrees[:, 0, 5]
    assert (nearest > farthest).all()
