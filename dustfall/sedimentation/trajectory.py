"""What a run leaves behind: its trajectory, its series, and the records they are made from."""

import hashlib
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from dustfall import __version__
from dustfall.columns import Column, started_checksum
from dustfall.extras import extra
from dustfall.files import atomic
from dustfall.units import RADIUS

with extra("files"):
    import netCDF4

CHECKED_AT_ONCE = 2**24
"""Bytes of a variable that are in memory at a time when its checksum is taken."""

TRACKED = 3
"""Particles whose position, velocity and force the series holds at every step."""

VECTORS = ("tracked_position", "tracked_velocity", "tracked_force")

SERIES = {
    "time": Column("tau", "time since the start"),
    "settling_velocity_mean": Column("v_s", "mean downward velocity of the particles"),
    "settling_velocity_variance": Column(
        "v_s^2", "variance of the downward velocity over particles"
    ),
    "drag_mean": Column("1", "mean upward drag over weight less buoyancy: one when steady"),
    "tracked_position": Column("d_p", "unwrapped position of tracked particles, z upwards"),
    "tracked_velocity": Column("v_s", "velocity of tracked particles, z upwards"),
    "tracked_force": Column("1", "drag on tracked particles over weight less buoyancy, z upwards"),
}
"""What the series of any run holds at each step; its closure adds its own."""


def series_type(columns: Iterable[str]) -> np.dtype:
    """Record of one step of a series with these columns."""
    return np.dtype([(name, "f8", (TRACKED, 3) if name in VECTORS else ()) for name in columns])


def frame_type(particles: int, precision: str) -> np.dtype:
    """Record of one frame; velocities and drag need no more than single precision."""
    return np.dtype(
        [
            ("time", "f8"),
            ("coordinates", precision, (particles, 3)),
            ("velocities", "f4", (particles, 3)),
            ("drag_coefficient", "f4", (particles,)),
        ]
    )


class Records:
    """Records of one fixed size, appended to a plain file.

    A file of fixed-size records can be cut back to a known count, which is what a run needs that
    was killed while it wrote; a half-written NetCDF file is lost. `digest()` is that of all records
    so far; whoever goes on from `count` records hands in what it was then.

    Raises
    ------
    ValueError : the file holds fewer than `count` records, or others.
    """

    def __init__(self, path: Path, record: np.dtype, count: int = 0, digest: str = ""):
        self.path = path
        self.record = record
        self._hash = hashlib.sha256()
        self.file = open(path, "r+b" if count else "w+b")  # noqa: SIM115 - open for a whole run
        try:
            for k in range(count):
                written = self.file.read(record.itemsize)
                if len(written) < record.itemsize:
                    raise ValueError(f"{path} holds {k} records, {count} are expected")
                self._hash.update(written)
            if count and self.digest() != digest:
                raise ValueError(f"{path} is damaged: its records do not match their checksum")
        except ValueError:
            self.file.close()
            raise
        self.file.truncate(count * record.itemsize)
        self.file.seek(0, os.SEEK_END)
        self.count = count

    def digest(self) -> str:
        """SHA-256 of all records so far."""
        return self._hash.hexdigest()

    def append(self, **values) -> None:
        """Write one record, given field by field."""
        row = np.empty((), self.record)
        for name in self.record.names or ():
            row[name] = values[name]
        written = row.tobytes()
        self.file.write(written)
        self._hash.update(written)
        self.count += 1

    def sync(self) -> None:
        """Make sure that all records so far survive a crash of the machine."""
        self.file.flush()
        os.fsync(self.file.fileno())

    def __iter__(self) -> Iterator[np.ndarray]:
        """The records from the first on, one in memory at a time.

        Raises ValueError after the last of them where they are not what was written.
        """
        self.file.flush()
        found = hashlib.sha256()
        with open(self.path, "rb") as file:
            for _ in range(self.count):
                written = file.read(self.record.itemsize)
                found.update(written)
                yield np.frombuffer(written, self.record)[0]
        if found.hexdigest() != self.digest():
            raise ValueError(
                f"{self.path} was damaged while the run went on; the same call goes on from the "
                "last state that stands on whole records"
            )

    def remove(self) -> None:
        """Close the file and delete it."""
        self.file.close()
        self.path.unlink()


def write_trajectory(path: Path, frames: Records, box_length: float, attributes: Mapping) -> None:
    """Write frames as NetCDF-4 in the AMBER convention, which OVITO and xarray open.

    Coordinates are unwrapped; `cell_lengths` folds them back into the cube. Lengths are in d_p,
    times in tau, velocities in v_s, as each variable's `units` say; `attributes` hold what these
    are in SI. The units are no CF units, and no CF convention is claimed. OVITO draws spheres of
    `radius`, xarray takes `time` for a coordinate and the labels for text.
    """
    particles = frames.record["coordinates"].shape[0]
    with atomic(path) as temporary, netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
        file.setncatts(
            {
                "Conventions": "AMBER",
                "ConventionVersion": "1.0",
                "program": "dustfall",
                "programVersion": __version__,
                "application": "dustfall.sedimentation",
                "title": "Sedimentation in a periodic cube",
                **attributes,
            }
        )
        for name, size in {"frame": None, "spatial": 3, "atom": particles}.items():
            file.createDimension(name, size)
        for name, size in {"cell_spatial": 3, "cell_angular": 3, "label": 5}.items():
            file.createDimension(name, size)

        def variable(name, kind, dimensions, units="", meaning="", **options):
            result = file.createVariable(name, kind, dimensions, **options)
            if units:
                result.units = units
                result.long_name = meaning
            if "frame" in dimensions and name != "time":
                result.coordinates = "time"
            return result

        labels = {
            ("spatial",): list("xyz"),
            ("cell_spatial",): list("abc"),
            ("cell_angular", "label"): [list("alpha"), list("beta "), list("gamma")],
        }
        for dimensions, letters in labels.items():
            label = variable(dimensions[0], "S1", dimensions)
            label[:] = np.array(letters, "S1")
            label.setncattr("_Encoding", "utf-8")
        variable("radius", "f4", ("atom",), "d_p", "of the particles")[:] = RADIUS
        time = variable("time", "f8", ("frame",), "tau", "time since the start")
        lengths = variable(
            "cell_lengths", "f8", ("frame", "cell_spatial"), "d_p", "side of the cube"
        )
        angles = variable("cell_angles", "f8", ("frame", "cell_angular"), "degree", "right angles")
        meaning = {
            "coordinates": ("d_p", "unwrapped positions, z upwards"),
            "velocities": ("v_s", "velocities, z upwards"),
            "drag_coefficient": ("1", "drag against the motion over that of an isolated sphere"),
        }
        columns = {}
        for name, (units, words) in meaning.items():
            field = frames.record[name]
            columns[name] = variable(
                name,
                field.base,
                ("frame", "atom", "spatial")[: 1 + field.ndim],
                units,
                words,
                chunksizes=(1, *field.shape),
            )
        written = {"time": time, "cell_lengths": lengths, "cell_angles": angles, **columns}
        checksums = {
            name: started_checksum(column.dtype, (frames.count, *column.shape[1:]))
            for name, column in written.items()
        }
        for k, frame in enumerate(frames):
            values = {"cell_lengths": np.full(3, box_length), "cell_angles": np.full(3, 90.0)}
            for name, column in written.items():
                row = values[name] if name in values else frame[name]
                column[k] = row
                checksums[name].update(row.tobytes())
        for name, column in written.items():
            column.sha256 = checksums[name].hexdigest()


def write_series(
    path: Path,
    series: Records,
    columns: Mapping[str, Column],
    tracked: np.ndarray,
    attributes: Mapping,
) -> None:
    """Write the series of a run as NetCDF-4 with dimensions step, tracked and spatial.

    `tracked` (3,) are the rows of the tracked particles in the trajectory; `columns` tells what
    each column holds.
    """
    with atomic(path) as temporary, netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
        file.setncatts({"title": "Sedimentation in a periodic cube, every step", **attributes})
        for name, size in {"step": series.count, "tracked": TRACKED, "spatial": 3}.items():
            file.createDimension(name, size)
        file.createVariable("spatial", "S1", ("spatial",))[:] = np.array(list("xyz"), "S1")
        file.createVariable("tracked", "i8", ("tracked",))[:] = tracked
        file["tracked"].long_name = "row of the particle in the trajectory"
        rows = np.fromiter(series, series.record, series.count)
        for name, (units, meaning) in columns.items():
            dimensions = ("step", "tracked", "spatial")[: rows[name].ndim]
            column = file.createVariable(name, rows[name].dtype, dimensions)
            column.units = units
            column.long_name = meaning
            column[:] = rows[name]
            checksum = started_checksum(rows[name].dtype, rows[name].shape)
            checksum.update(rows[name].tobytes())
            column.sha256 = checksum.hexdigest()


@contextmanager
def open_run(path: str | Path) -> Iterator[netCDF4.Dataset]:
    """Open a trajectory or series, after its variables were compared with their checksums.

    A file of another program has none. Raises FileNotFoundError where there is no such file, and
    ValueError, with the names of file and variable, for one that is damaged or no NetCDF file.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    try:
        file = netCDF4.Dataset(path)
    except (OSError, RuntimeError, ValueError, KeyError, AttributeError) as error:
        raise ValueError(f"{path} is damaged or no NetCDF file ({error})") from error
    with file:
        file.set_auto_mask(False)
        for name, variable in file.variables.items():
            try:
                whole = "sha256" not in variable.ncattrs() or _matches(variable, path)
            except (OSError, RuntimeError, ValueError, AttributeError, IndexError):
                whole = False
            if not whole:
                raise ValueError(
                    f"{path} is damaged, or was changed: its variable {name} does not match its "
                    "attribute sha256, which whoever changes it on purpose removes"
                )
        yield file


def _matches(variable: netCDF4.Variable, path: Path) -> bool:
    """Whether a variable is what its checksum says."""
    # One that has a checksum lies there as it is: it is no larger than its file.
    size = variable.dtype.itemsize * math.prod(variable.shape)
    return size <= path.stat().st_size and variable.sha256 == _checksum(variable)


def _checksum(variable: netCDF4.Variable) -> str:
    """Of what a variable holds, read part by part."""
    checksum = started_checksum(variable.dtype, variable.shape)
    row = max(1, variable.dtype.itemsize * math.prod(variable.shape[1:]))
    rows = max(1, CHECKED_AT_ONCE // row)
    for first in range(0, variable.shape[0], rows):
        checksum.update(np.ascontiguousarray(variable[first : first + rows]).tobytes())
    return checksum.hexdigest()
