import numpy as np
import pytest
import xarray as xr

from dustfall.sedimentation import random_positions, start_from
from dustfall.sedimentation.start import read_start
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


@pytest.mark.parametrize("columns", [3, 6])
def test_plain_text_holds_positions_and_perhaps_velocities(tmp_path, columns):
    path = tmp_path / "start.txt"
    table = np.hstack([POSITIONS, VELOCITIES])[:, :columns]
    np.savetxt(path, table, header="x y z", fmt="%.17g")
    positions, velocities = read_start(path, 40, 1e-3)
    np.testing.assert_array_equal(positions, POSITIONS)
    if columns == 3:
        assert velocities is None
    else:
        np.testing.assert_array_equal(velocities, VELOCITIES)


def test_given_velocities_take_the_place_of_the_usual_start(tmp_path):
    _, series = run(tmp_path, positions=POSITIONS, velocities=VELOCITIES, start="stokes")
    tracked = series.tracked.values
    np.testing.assert_array_equal(series.tracked_velocity[0], VELOCITIES[tracked])


def test_files_that_do_not_fit_are_refused_by_name(tmp_path):
    table = tmp_path / "start.txt"
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
    with pytest.raises(ValueError, match="coordinates in m: d_p needed"):
        read_start(tmp_path / "metres.nc", 40, 1e-3)
    with pytest.raises(ValueError, match="no variable coordinates"):
        read_start(tmp_path / "empty.nc", 40, 1e-3)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"velocity": VELOCITIES[:7]}, r"velocities have shape \(7, 3\)"),
        ({"velocity": VELOCITIES * np.inf}, "velocities at the start"),
        ({"velocity": "flying"}, "start is 'flying'"),
        ({"position": np.where(POSITIONS > 5, np.nan, POSITIONS)}, "positions at the start"),
    ],
)
def test_starts_that_cannot_be_are_refused_by_name(change, named):
    with pytest.raises(ValueError, match=named):
        start_from(**{"position": POSITIONS, "volume_fraction": 1e-3} | change)
