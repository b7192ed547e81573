"""Leftovers of a file are its own, whatever its name."""

import pytest

from dustfall.files import remove_leftovers


@pytest.mark.parametrize("stem", ["case", "case[1]", "ca?e", "c*e"])
def test_leftovers_of_a_file_are_removed_and_those_of_others_stay(tmp_path, stem):
    own, others = tmp_path / f".{stem}.abcd1234.nc", [".case1.abcd1234.nc", ".cane.abcd1234.nc"]
    for name in (own.name, *others):
        (tmp_path / name).touch()
    remove_leftovers(tmp_path / f"{stem}.nc")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(others)
