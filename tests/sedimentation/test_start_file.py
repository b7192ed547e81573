import re

import netCDF4
import numpy as np
import pytest
import xarray as xr

from dustfall.sedimentation import box_length, random_positions, start_from
from dustfall.sedimentation.start import START_TABLE, read_start
from dustfall.tables import Quantity, write_table
from tests.sedimentation.runs import run

POSITIONS = random_positions(np.random.default_rng(1), 40, 1e-3)
VELOCITIES = np.random.default_rng(2).normal(size=(40, 3))


def test_a_run_goes_on_from_the_last_frame_of_another(tmp_path):
    first, _ = run(tmp_path, positions=POSITIONS)
    positions, velocities = read_start(tmp_path / "case.nc", 40, 1e-3)
    np.testing.assert_array_equal(positions, first.coordinates[-1])
    np.testing.assert_array_equal(velocities, first.velocities[-1])
    second, _ = run(tmp_path, positions=positions, velocities=velocities)
    np.testing.assert_array_equal(second.coordinates[0], first.coordinates[-1])
    np.testing.assert_array_equal(second.velocities[0], first.velocities[-1])


@pytest.mark.parametrize("suffix", ["txt", "dat", "xyz"])
@pytest.mark.parametrize("columns", [3, 6])
def test_plain_text_holds_positions_and_perhaps_velocities(tmp_path, columns, suffix):
    path = tmp_path / f"start.{suffix}"
    table = np.hstack([POSITIONS, VELOCITIES])[:, :columns]
    np.savetxt(path, table, header="x y z", fmt="%.17g")
    positions, velocities = read_start(path, 40, 1e-3)
    np.testing.assert_array_equal(positions, POSITIONS)
    if columns == 3:
        assert velocities is None
    else:
        np.testing.assert_array_equal(velocities, VELOCITIES)


@pytest.mark.parametrize("suffix", ["csv", "txt", "npy", "h5"])
def test_a_table_that_was_written_is_one_to_start_from(tmp_path, suffix):
    force = Quantity((3,), "Re_p c_D", "that nobody asks for")
    quantities = {"position": START_TABLE["position"], "force": force}
    quantities["velocity"] = START_TABLE["velocity"]
    path = tmp_path / f"start.{suffix}"
    values = {"position": POSITIONS, "force": POSITIONS, "velocity": VELOCITIES}
    write_table(path, quantities, values)
    positions, velocities = read_start(path, 40, 1e-3)
    np.testing.assert_array_equal(positions, POSITIONS)
    np.testing.assert_array_equal(velocities, VELOCITIES)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("x y z\n1 2 three\n4 5 6\n", "could not convert string 'three'"),
        ("x y z\n1 2 3\n4 5 6\n7 8 9\n", "holds 3 particles: 2 are needed"),
        ("x [m] y [m] z [m]\n1 2 3\n4 5 6\n", "6 names for 3 columns|is in m"),
        ("x,y\n1,2\n4,5\n", "no column z among x, y"),
        ("1 2 3 4\n4 5 6 7\n", "4 columns without names"),
        (" " * 200_000, "has 200000 bytes: a table of 2 particles has at most"),
    ],
)
def test_text_that_is_no_start_is_refused_by_its_name(tmp_path, content, words):
    path = tmp_path / "start.txt"
    path.write_text(content)
    with pytest.raises(ValueError, match=words) as refusal:
        read_start(path, 2, 1e-3)
    assert "start.txt" in str(refusal.value)


def test_a_trajectory_of_another_program_may_hold_text(tmp_path):
    side = box_length(40, 1e-3)
    with netCDF4.Dataset(tmp_path / "other.nc", "w") as file:
        for name, size in {"frame": None, "atom": 40, "spatial": 3}.items():
            file.createDimension(name, size)
        file.createVariable("element", str, ("atom",))[:] = np.full(40, "Si", object)
        file.createVariable("cell_lengths", "f8", ("frame", "spatial"))[0] = np.full(3, side)
        file.createVariable("coordinates", "f8", ("frame", "atom", "spatial"))[0] = POSITIONS
    positions, velocities = read_start(tmp_path / "other.nc", 40, 1e-3)
    np.testing.assert_array_equal(positions, POSITIONS)
    assert velocities is None


def test_given_velocities_take_the_place_of_the_usual_start(tmp_path):
    _, series = run(tmp_path, positions=POSITIONS, velocities=VELOCITIES, start="stokes")
    tracked = series.tracked.values
    np.testing.assert_array_equal(series.tracked_velocity[0], VELOCITIES[tracked])


def test_files_that_do_not_fit_are_refused_by_name(tmp_path):
    table = tmp_path / "start.dat"
    np.savetxt(table, POSITIONS)
    with pytest.raises(ValueError, match="holds 40 particles: 41 are needed"):
        read_start(table, 41, 1e-3)
    np.savetxt(table, POSITIONS[:, :2])
    with pytest.raises(ValueError, match="has 2 columns: 3 or 6"):
        read_start(table, 40, 1e-3)
    run(tmp_path, positions=POSITIONS)
    with pytest.raises(ValueError, match="fill a cube of"):
        read_start(tmp_path / "case.nc", 40, 1e-4)
    with xr.load_dataset(tmp_path / "case.nc") as dataset:
        dataset.coordinates.attrs["units"] = "m"
        dataset.to_netcdf(tmp_path / "metres.nc")
        dataset.drop_vars("coordinates").to_netcdf(tmp_path / "empty.nc")
        for name in dataset.variables:
            dataset[name].attrs.pop("sha256", None)
        dataset.coordinates.attrs["units"] = "d_p"
        dataset.coordinates[-1, 7, 1] = np.nan
        encoding = {"coordinates": {"_FillValue": -1.0}}
        dataset.to_netcdf(tmp_path / "hole.nc", encoding=encoding)
    with pytest.raises(ValueError, match=r"hole\.nc.*the value at \[7, 1\] is missing"):
        read_start(tmp_path / "hole.nc", 40, 1e-3)
    with pytest.raises(ValueError, match="coordinates in m: d_p needed"):
        read_start(tmp_path / "metres.nc", 40, 1e-3)
    with pytest.raises(ValueError, match="no variable coordinates"):
        read_start(tmp_path / "empty.nc", 40, 1e-3)


def flipped(whole: bytes, rng) -> bytes:
    damaged = bytearray(whole)
    damaged[rng.integers(len(whole))] ^= 1 << rng.integers(8)
    return bytes(damaged)


def test_no_flipped_bit_of_a_trajectory_moves_a_particle_unseen(tmp_path):
    run(tmp_path, positions=POSITIONS)
    path = tmp_path / "case.nc"
    whole, expected = path.read_bytes(), read_start(path, 40, 1e-3)
    rng, told = np.random.default_rng(3), []
    for _ in range(200):
        path.write_bytes(flipped(whole, rng))
        try:
            found = read_start(path, 40, 1e-3)
        except ValueError as error:
            told.append(str(error))
            continue
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)
    assert len(told) > 50
    assert all("case.nc" in words for words in told)


TABLES = {
    "text": ("no table at all\n", "no table of numbers: could not convert .* at row 0, column 1"),
    "hole": ("1 2 3\n4 5\n", "no table of numbers: the number of columns changed .* at row 2"),
    "nan": ("1 2 3\n4 nan 6\n", r"positions at the start hold \[4.0, nan, 6.0\] for particle 1"),
    "far": ("1 2 3\n4 1e300 6\n", r"hold \[4.0, 1e\+300, 6.0\] for particle 1: allowed are finite"),
    "wild": ("1 2 3 0 0 0\n4 5 6 0 0 1e6\n", "velocities at the start hold .* at most 100 v_s"),
    "metres": ("1e-5 2e-4 3e-4\n4e-5 5e-5 6e-4\n", "particles 0 and 1 .*: these look like metres"),
    "overlap": ("1 2 3\n1.5 2 3\n", "particles 0 and 1 .* 0.5 d_p apart: at least 1 is needed"),
    "twice": (
        "7 8 9\n1 2 3\n4 5 6\n1 2 3\n",
        "particles 1 and 3 .*, their centres are 0 d_p apart",
    ),
    "empty": ("", "holds no particle: 2 are needed"),
    "columns": ("1 2\n3 4\n", "has 2 columns: 3 or 6 are needed"),
    "large": (" " * 200_000, "has 200000 bytes: a table of 2 particles has at most"),
    "bytes": ("\udcff\udcfe\n", "no table of numbers"),
    "wrapped": ("0.2 5 5\n12.6 5 5\n", r"particles 0 and 1 .* 0\.17\d* d_p apart"),
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_that_are_no_start_are_refused_with_file_row_and_what_is_allowed(tmp_path, name):
    content, words = TABLES[name]
    path = tmp_path / f"{name}.dat"
    path.write_bytes(content.encode("utf-8", "surrogateescape"))
    with pytest.raises(ValueError, match=words) as refusal:
        # A cube of 12.57 d_p.
        read_start(path, 4 if name == "twice" else 2, 5.27e-4)
    assert f"{name}.dat" in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_many_particles_in_one_place_are_refused_at_once(tmp_path):
    path = tmp_path / "start.txt"
    np.savetxt(path, np.full((100_000, 3), 0.5), fmt="%g")
    with pytest.raises(ValueError, match=r"particles .* overlap") as refusal:
        read_start(path, 100_000, 1e-3)
    one, other = re.search(r"particles (\d+) and (\d+)", str(refusal.value)).groups()
    assert one != other


def test_a_folder_and_a_device_are_no_start(tmp_path):
    for path in (tmp_path, "/dev/zero"):
        with pytest.raises(ValueError, match="is no file"):
            read_start(path, 40, 1e-3)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"velocity": VELOCITIES[:7]}, r"velocities have shape \(7, 3\)"),
        ({"velocity": VELOCITIES * np.inf}, "velocities at the start"),
        ({"velocity": "flying"}, "start is 'flying'"),
        ({"position": np.where(POSITIONS > 5, np.nan, POSITIONS)}, "positions at the start"),
        ({"position": np.ma.masked_greater(POSITIONS, 5)}, "the value at .* is missing"),
        ({"position": 1e20 * POSITIONS}, "positions at the start"),
        ({"position": "here"}, "positions must be an array of numbers"),
        ({"position": 3.0}, r"positions are one number: \(n, 3\) are needed"),
        ({"position": 3.0, "velocity": VELOCITIES}, "positions are one number"),
    ],
)
def test_starts_that_cannot_be_are_refused_by_name(change, named):
    with pytest.raises(ValueError, match=named):
        start_from(**{"position": POSITIONS, "volume_fraction": 1e-3} | change)
