"""Columns come back as they were written, labelled, and damage on disk is told."""

import h5py
import numpy as np
import pytest

from dustfall.columns import Column, read_columns, write_columns

COLUMNS = {
    "force": Column("Re_p c_D", "on each sphere"),
    "status": Column("", "how it ended"),
}
VALUES = {"force": np.arange(600.0).reshape(100, 2, 3), "status": np.array(["fine", "über"] * 50)}


def test_columns_are_read_as_they_were_written_with_their_labels(tmp_path):
    write_columns(tmp_path / "a.h5", COLUMNS, VALUES, {"seed": 7})
    found = read_columns(tmp_path / "a.h5", COLUMNS)
    for name, values in VALUES.items():
        np.testing.assert_array_equal(found[name], values)
    with h5py.File(tmp_path / "a.h5") as file:
        assert file.attrs["seed"] == 7
        assert file["force"].attrs["units"] == "Re_p c_D"
        assert file["status"].attrs["description"] == "how it ended"


def test_equal_columns_make_equal_files(tmp_path):
    for name in "ab":
        write_columns(tmp_path / f"{name}.h5", COLUMNS, VALUES)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_no_flipped_bit_changes_a_number_unseen(tmp_path):
    path = tmp_path / "a.h5"
    write_columns(path, COLUMNS, VALUES)
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    told = 0
    for _ in range(200):
        damaged = bytearray(whole)
        damaged[rng.integers(len(whole))] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            found = read_columns(path, COLUMNS)
        except ValueError:
            told += 1
            continue
        # Bits between the arrays may be anything.
        for name, values in VALUES.items():
            np.testing.assert_array_equal(found[name], values)
    assert told > 100


@pytest.mark.parametrize("length", [0, 100, 3000])
def test_a_truncated_file_is_told_by_name(tmp_path, length):
    path = tmp_path / "a.h5"
    write_columns(path, COLUMNS, VALUES)
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(ValueError, match=r"a\.h5 is damaged"):
        read_columns(path, COLUMNS)


def test_a_missing_file_and_a_missing_column_are_told_apart(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"a\.h5"):
        read_columns(tmp_path / "a.h5", COLUMNS)
    write_columns(tmp_path / "a.h5", {"force": COLUMNS["force"]}, VALUES)
    with pytest.raises(ValueError, match="status"):
        read_columns(tmp_path / "a.h5", COLUMNS)
