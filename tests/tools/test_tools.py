"""The programs that users open a run with see the particles where the run has them."""

import os
import shutil
import subprocess
import warnings

import netCDF4
import numpy as np
import pytest
import xarray as xr

from dustfall.cli import main
from dustfall.forces.formulas.isolated import MODEL as ISOLATED
from dustfall.sedimentation import Properties
from dustfall.units import RADIUS
from tests.sedimentation.runs import run

pytestmark = pytest.mark.tools

PARTICLES, FRAMES = 40, 4

PROPERTIES = Properties(diameter=1e-5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run and all that it is exported as."""
    folder = tmp_path_factory.mktemp("run")
    run(
        folder, ISOLATED, particles=PARTICLES, step=0.5, duration=6.0, save_interval=2.0,
        start="stokes", precision="float32", properties=PROPERTIES,
    )  # fmt: skip
    for kind in ("vtkhdf", "pvd", "amber"):
        for positions in ("folded", "unwrapped"):
            target = folder / f"{positions}.{'amber.nc' if kind == 'amber' else kind}"
            command = ["export", str(folder / "case.nc"), "--to", kind, "-o", str(target)]
            assert main([*command, "--positions", positions]) == 0
    return folder


@pytest.fixture(scope="module")
def truth(folder):
    """The run as netCDF4 reads it: positions, velocities, side of the cube, times."""
    with netCDF4.Dataset(folder / "case.nc") as file:
        names = ("coordinates", "velocities", "cell_lengths", "time")
        position, velocity, sides, time = (file[name][:].filled() for name in names)
    return position, velocity, sides[0, 0], time


def same_but_for_whole_sides(found, expected, side):
    """Folded positions are whole sides from where the particles went."""
    sides = (found - expected) / side
    return (
        (found >= 0).all() and (found <= side).all() and np.allclose(sides, sides.round(), 0, 1e-5)
    )


@pytest.mark.parametrize("name", ["case.nc", "unwrapped.amber.nc", "folded.amber.nc"])
def test_ovito_shows_spheres_of_their_size_in_their_cube(folder, truth, name):
    from ovito.io import import_file

    position, velocity, side, _ = truth
    length = 1.0 if name == "case.nc" else PROPERTIES.diameter * 1e10
    speed = 1.0 if name == "case.nc" else PROPERTIES.settling_velocity / 100
    pipeline = import_file(folder / name)
    assert pipeline.num_frames == FRAMES
    for k in range(FRAMES):
        data = pipeline.compute(k)
        assert set(data.cell.pbc) == {True}
        np.testing.assert_allclose(np.diag(data.cell[:, :3]) / length, side, rtol=1e-6)
        found = np.asarray(data.particles["Position"]) / length
        if name.startswith("folded"):
            assert same_but_for_whole_sides(found, position[k], side)
        else:
            np.testing.assert_allclose(found, position[k], rtol=1e-6)
        np.testing.assert_allclose(
            np.asarray(data.particles["Velocity"]) / speed, velocity[k], atol=1e-6
        )
        np.testing.assert_allclose(np.asarray(data.particles["Radius"]) / length, RADIUS)


def test_mdanalysis_reads_angstrom_and_picoseconds(folder, truth):
    import MDAnalysis

    position, velocity, side, time = truth
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        universe = MDAnalysis.Universe.empty(PARTICLES, trajectory=True, velocities=True)
        universe.load_new(str(folder / "unwrapped.amber.nc"), format="NCDF")
    assert len(universe.trajectory) == FRAMES
    for k, step in enumerate(universe.trajectory):
        metres, seconds = step.positions * 1e-10, step.time * 1e-12
        np.testing.assert_allclose(metres / PROPERTIES.diameter, position[k], rtol=1e-5)
        assert seconds == pytest.approx(PROPERTIES.response_time * time[k], rel=1e-6)
        found = step.velocities * 100 / PROPERTIES.settling_velocity
        np.testing.assert_allclose(found, velocity[k], atol=1e-6)
        cell = step.dimensions[:3] * 1e-10 / PROPERTIES.diameter
        np.testing.assert_allclose(cell, side, rtol=1e-6)


@pytest.mark.parametrize("positions", ["folded", "unwrapped"])
@pytest.mark.parametrize("kind", ["vtkhdf", "pvd"])
def test_vtk_finds_every_time_step(folder, truth, kind, positions):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOHDF import vtkHDFReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    position, velocity, side, time = truth
    for k in range(FRAMES):
        if kind == "vtkhdf":
            reader = vtkHDFReader()
            reader.SetFileName(str(folder / f"{positions}.vtkhdf"))
            reader.UpdateInformation()
            key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
            assert list(reader.GetOutputInformation(0).Get(key)) == time.tolist()
            reader.UpdateTimeStep(time[k])
        else:
            reader = vtkXMLPolyDataReader()
            reader.SetFileName(str(folder / positions / f"{k:06d}.vtp"))
            reader.Update()
        data = reader.GetOutputDataObject(0)
        assert data.GetNumberOfVerts() == PARTICLES
        found = vtk_to_numpy(data.GetPoints().GetData())
        if positions == "folded":
            assert same_but_for_whole_sides(found, position[k], side)
        else:
            np.testing.assert_array_equal(found, position[k])
        columns = data.GetPointData()
        np.testing.assert_array_equal(vtk_to_numpy(columns.GetArray("velocities")), velocity[k])
        rows = vtk_to_numpy(columns.GetArray("particle"))
        np.testing.assert_array_equal(rows, np.arange(PARTICLES))


PARAVIEW = """
from paraview.simple import OpenDataFile
reader = OpenDataFile("{path}")
for time in reader.TimestepValues:
    reader.UpdatePipeline(time)
    found = reader.GetDataInformation()
    print(time, found.GetNumberOfPoints(), *found.GetBounds())
"""


@pytest.mark.skipif(shutil.which("pvpython") is None, reason="ParaView is not installed")
def test_paraview_opens_the_list_of_frames(folder, truth):
    position, _, _, time = truth
    done = subprocess.run(
        ["pvpython", "-c", PARAVIEW.format(path=folder / "unwrapped.pvd")],
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    lines = [list(map(float, line.split())) for line in done.stdout.splitlines()[-FRAMES:]]
    for k, (seen, points, *bounds) in enumerate(lines):
        assert (seen, points) == (time[k], PARTICLES)
        expected = np.transpose([position[k].min(axis=0), position[k].max(axis=0)]).ravel()
        np.testing.assert_allclose(bounds, expected, rtol=1e-6)


def test_xarray_selects_by_time_and_by_axis(folder, truth):
    position, _, _, time = truth
    with xr.open_dataset(folder / "case.nc") as data:
        moments = data.swap_dims(frame="time")
        found = moments.sel(time=4.0, method="nearest")["coordinates"].sel(spatial="z")
        np.testing.assert_array_equal(found, position[time == 4.0][0][:, 2])
        assert "time" in data["velocities"].coords
        assert data["radius"].attrs["units"] == "d_p"
