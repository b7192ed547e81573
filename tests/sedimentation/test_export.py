"""Exported files hold every frame of the trajectory, where and in the units that they say."""

from itertools import pairwise
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

from dustfall.forces.formulas.isolated import MODEL as ISOLATED
from dustfall.sedimentation.export import (
    CELL_KINDS,
    export_amber,
    export_pvd,
    export_vtkhdf,
)
from tests.sedimentation.runs import DUST, run

PARTICLES = 40


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    run(
        folder, ISOLATED, particles=PARTICLES, step=0.5, duration=6.0, save_interval=2.0,
        start="stokes", precision="float32",
    )  # fmt: skip
    return folder / "case.nc"


def frame(file, k):
    """Points, vertices and point data of one time step, found as the format's text says."""
    root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
    part, first = steps["PartOffsets"][k], steps["PointOffsets"][k]
    points = root["Points"][first : first + root["NumberOfPoints"][part]]
    data = {}
    for name, begins in steps["PointDataOffsets"].items():
        data[name] = root["PointData"][name][begins[k] : begins[k] + len(points)]
    cells = {}
    for i, kind in enumerate(CELL_KINDS):
        begin = steps["CellOffsets"][k, i]
        number = root[kind]["NumberOfCells"][part]
        offsets = root[kind]["Offsets"][begin : begin + number + 1]
        ids = root[kind]["Connectivity"][steps["ConnectivityIdOffsets"][k, i] :]
        cells[kind] = [ids[a:b].tolist() for a, b in pairwise(offsets)]
    return points, cells, data


def test_every_frame_is_found_again(trajectory, tmp_path):
    seen = []
    export_vtkhdf(
        trajectory, tmp_path / "case.vtkhdf", folded=False, progress=lambda *a: seen.append(a)
    )
    source = xr.load_dataset(trajectory)
    with h5py.File(tmp_path / "case.vtkhdf") as file:
        assert file["VTKHDF"].attrs["Type"] == b"PolyData"
        np.testing.assert_array_equal(file["VTKHDF/Steps/Values"], source["time"])
        assert file["VTKHDF/Steps"].attrs["NSteps"] == source.sizes["frame"] == 4
        for k in range(4):
            points, cells, data = frame(file, k)
            np.testing.assert_array_equal(points, source["coordinates"][k])
            np.testing.assert_array_equal(data["velocities"], source["velocities"][k])
            np.testing.assert_array_equal(data["drag_coefficient"], source["drag_coefficient"][k])
            np.testing.assert_array_equal(data["particle"], np.arange(PARTICLES))
            assert cells.pop("Vertices") == [[i] for i in range(PARTICLES)]
            assert set(map(len, cells.values())) == {0}
    assert seen == [(k, 4) for k in (1, 2, 3, 4)]


def test_folded_points_lie_in_the_cube_whole_sides_from_where_they_are(trajectory, tmp_path):
    export_vtkhdf(trajectory, tmp_path / "case.vtkhdf")
    source = xr.load_dataset(trajectory)
    side = source["cell_lengths"].values[0, 0]
    with h5py.File(tmp_path / "case.vtkhdf") as file:
        points = frame(file, 3)[0]
    assert (points >= 0).all()
    assert (points < np.float32(side)).all()
    sides = (points - source["coordinates"][3].values) / side
    np.testing.assert_allclose(sides, sides.round(), atol=1e-5)
    assert np.abs(sides).max() > 1.5


def test_units_and_the_settings_of_the_run_come_along(trajectory, tmp_path):
    export_vtkhdf(trajectory, tmp_path / "case.vtkhdf")
    with h5py.File(tmp_path / "case.vtkhdf") as file:
        units = {
            name: file["VTKHDF"][name].attrs["units"]
            for name in ("Points", "PointData/velocities", "Steps/Values")
        }
        assert units == {"Points": "d_p", "PointData/velocities": "v_s", "Steps/Values": "tau"}
        assert file["run"].attrs["volume_fraction"] == 1e-3
        assert "kg m^-3" in file["run"].attrs["units"]


def test_si_units_are_those_of_the_properties(trajectory, tmp_path):
    export_vtkhdf(trajectory, tmp_path / "case.vtkhdf", folded=False, si=True)
    export_vtkhdf(trajectory, tmp_path / "own.vtkhdf", folded=False)
    worth = {
        "Points": (DUST.diameter, "m"),
        "PointData/velocities": (DUST.settling_velocity, "m s^-1"),
        "PointData/drag_coefficient": (1.0, "1"),
        "Steps/Values": (DUST.response_time, "s"),
    }
    with h5py.File(tmp_path / "case.vtkhdf") as si, h5py.File(tmp_path / "own.vtkhdf") as own:
        for name, (factor, unit) in worth.items():
            assert si["VTKHDF"][name].attrs["units"] == unit
            expected = own["VTKHDF"][name][()] * factor
            np.testing.assert_allclose(si["VTKHDF"][name][()], expected, rtol=1e-6)


def test_amber_files_are_netcdf_3_in_the_units_of_the_convention(trajectory, tmp_path):
    export_amber(trajectory, tmp_path / "amber.nc", folded=False)
    source = xr.load_dataset(trajectory)
    metres, seconds = DUST.diameter / 1e-10, DUST.response_time / 1e-12
    worth = {
        "coordinates": (metres, "angstrom"),
        "cell_lengths": (metres, "angstrom"),
        "radius": (metres, "angstrom"),
        "time": (seconds, "picosecond"),
        "velocities": (DUST.settling_velocity / 100, "angstrom/picosecond"),
        "cell_angles": (1.0, "degree"),
    }
    with netcdf_file(tmp_path / "amber.nc", mmap=False) as file:
        assert file.Conventions == b"AMBER"
        assert file.variables["cell_angular"][:].tobytes() == b"alphabeta gamma"
        for name, (factor, unit) in worth.items():
            assert file.variables[name].units == unit.encode()
            expected = source[name].values.astype(float) * factor
            np.testing.assert_allclose(file.variables[name][:], expected, rtol=1e-6)


def test_a_list_of_frames_names_them_with_their_times(trajectory, tmp_path):
    export_pvd(trajectory, tmp_path / "a & b.pvd")
    root = ElementTree.parse(tmp_path / "a & b.pvd").getroot()
    entries = [(float(e.get("timestep")), tmp_path / e.get("file")) for e in root.iter("DataSet")]
    assert [time for time, _ in entries] == [0, 2, 4, 6]
    assert all(path.read_bytes().startswith(b"<VTKFile") for _, path in entries)
    with pytest.raises(ValueError, match="no suffix"):
        export_pvd(trajectory, tmp_path / "frames")


def test_a_run_without_properties_has_no_other_units(trajectory, tmp_path):
    bare = tmp_path / "bare.nc"
    dataset = xr.load_dataset(trajectory)
    del dataset.attrs["diameter"]
    dataset.to_netcdf(bare, unlimited_dims=["frame"])
    with pytest.raises(ValueError, match="does not say its diameter in SI"):
        export_amber(bare, tmp_path / "amber.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["bare.nc"]


def test_other_files_are_refused_and_leave_nothing(trajectory, tmp_path):
    series = trajectory.with_suffix(".series.nc")
    with pytest.raises(ValueError, match=r"no variable 'coordinates'"):
        export_vtkhdf(series, tmp_path / "case.vtkhdf")
    empty = tmp_path / "empty.nc"
    dataset = xr.load_dataset(trajectory).isel(frame=slice(0, 0))
    for name in dataset.variables:
        dataset[name].attrs.pop("sha256", None)
    dataset.to_netcdf(empty, unlimited_dims=["frame"])
    with pytest.raises(ValueError, match="no frame"):
        export_vtkhdf(empty, tmp_path / "case.vtkhdf")
    assert [path.name for path in tmp_path.iterdir()] == ["empty.nc"]
