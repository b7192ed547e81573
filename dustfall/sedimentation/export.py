"""Trajectories as other programs open them: VTK files for ParaView, NetCDF-3 for MDAnalysis."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from dustfall.extras import extra
from dustfall.files import atomic
from dustfall.sedimentation.trajectory import open_run

with extra("files"):
    import h5py
    import netCDF4

VERSION = (2, 0)
"""Of the VTKHDF format: the first with polygonal data that change in time (ParaView 5.12)."""

CELL_KINDS = ("Vertices", "Lines", "Polygons", "Strips")
"""Groups of cells that a reader expects of polygonal data, in this order."""

LARGEST_INTEGER = 2**31 - 1
"""Largest whole number that NetCDF-3 holds."""

Units = Mapping[str, tuple[float, str]]
"""By a unit of the run: what it is worth in another one, and the name of that."""

IN_SI = {
    "m": 1.0,
    "s": 1.0,
    "m s^-1": 1.0,
    "angstrom": 1e-10,
    "picosecond": 1e-12,
    "angstrom/picosecond": 1e-10 / 1e-12,
}

Progress = Callable[[int, int], None] | None


def export_vtkhdf(
    trajectory: str | Path,
    target: str | Path,
    folded: bool = True,
    si: bool = False,
    progress: Progress = None,
) -> None:
    """Write a trajectory as VTKHDF temporal polygonal data, a vertex for each particle.

    Points carry all that the trajectory holds of each particle in each frame, like `velocities`
    [v_s] and `drag_coefficient`, and `particle`, its row there. Units stand in the attribute
    `units` of each array, the attributes of the run in those of the group `run`. One frame is in
    memory at a time. Layout: VTKHDF file format 2.0, docs.vtk.org; the cells are the same in all
    frames and are written once.

    Parameters
    ----------
    trajectory : NetCDF file as `write_trajectory` makes it
    target : file to write, best with the suffix .vtkhdf, by which ParaView knows it
    folded : put every particle into the periodic cube; else positions stay unwrapped
    si : in m, s and m/s; else in d_p, tau and v_s
    progress : called with the number of frames done and of all frames

    Raises
    ------
    FileNotFoundError : there is no trajectory.
    ValueError : the file is damaged, has no frame, or lacks a variable of a trajectory, or a
        property that other units need.
    """
    with _opened(trajectory) as run, atomic(target) as temporary, h5py.File(temporary, "w") as file:
        units = run.in_units("m", "s", "m s^-1") if si else {}
        file.create_group("run").attrs.update(run.attributes)
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array(VERSION, "i8")
        # Readers take a string of fixed length alone.
        root.attrs.create("Type", np.bytes_("PolyData"))
        _write_cells(root, run.particles)
        names = [name for name in run.moving() if name != "coordinates"]
        _write_steps(root, run, units, names)
        total = run.frames * run.particles
        points = _like(root, "Points", run.file["coordinates"], total, units)
        data = root.create_group("PointData")
        columns = {name: _like(data, name, run.file[name], total, units) for name in names}
        data["particle"] = np.arange(run.particles, dtype="i4")
        for k, frame in run.read(units, folded, progress):
            rows = slice(k * run.particles, (k + 1) * run.particles)
            points[rows] = frame["coordinates"]
            for name, column in columns.items():
                column[rows] = frame[name]


def export_pvd(
    trajectory: str | Path,
    target: str | Path,
    folded: bool = True,
    si: bool = False,
    progress: Progress = None,
) -> None:
    """Write a trajectory as a file of VTK polygonal data a frame, and the list of them that opens.

    The frames lie beside the list, in a folder that has its name without the suffix. Any ParaView
    opens them; VTKHDF is one file. Parameters and errors as those of `export_vtkhdf`.
    Layout: VTK XML file formats, docs.vtk.org.
    """
    target = Path(target)
    if not target.suffix:
        raise ValueError(f"{target} has no suffix, as .pvd is: its frames need a name of their own")
    folder = target.with_suffix("")
    entries = []
    with _opened(trajectory) as run:
        units = run.in_units("m", "s", "m s^-1") if si else {}
        times = _scaled(run.file["time"], run.file["time"][:], units)
        for k, frame in run.read(units, folded, progress):
            path = folder / f"{k:06d}.vtp"
            with atomic(path) as temporary:
                temporary.write_bytes(_vtp({name: frame[name] for name in run.moving()}))
            file = quoteattr(f"{folder.name}/{path.name}")
            entries.append(f'<DataSet timestep="{float(times[k])!r}" file={file}/>\n')
    with atomic(target) as temporary:
        temporary.write_text(
            f'<VTKFile type="Collection" version="1.0">\n<Collection>\n{"".join(entries)}'
            "</Collection>\n</VTKFile>\n"
        )


def _vtp(columns: dict[str, np.ndarray]) -> bytes:
    """Particles as a VTK file: a vertex each, with what `columns` hold of them as point data."""
    particles = len(columns["coordinates"])
    blocks: list[bytes] = []

    def array(name: str, values: np.ndarray) -> str:
        values = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
        kind = {"f": "Float", "i": "Int"}[values.dtype.kind] + str(8 * values.dtype.itemsize)
        offset = sum(map(len, blocks))
        blocks.append(np.array(values.nbytes, "<u8").tobytes() + values.tobytes())
        return (
            f'<DataArray Name="{name}" type="{kind}" NumberOfComponents="{values[0].size}" '
            f'format="appended" offset="{offset}"/>\n'
        )

    points = array("Points", columns["coordinates"])
    numbers = np.arange(particles, dtype="i8")
    vertices = array("connectivity", numbers) + array("offsets", numbers + 1)
    data = "".join(array(name, columns[name]) for name in columns if name != "coordinates")
    data += array("particle", numbers)
    head = (
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f'<PolyData>\n<Piece NumberOfPoints="{particles}" NumberOfVerts="{particles}">\n'
        f"<Points>\n{points}</Points>\n<Verts>\n{vertices}</Verts>\n"
        f"<PointData>\n{data}</PointData>\n</Piece>\n</PolyData>\n"
        '<AppendedData encoding="raw">\n_'
    )
    return head.encode() + b"".join(blocks) + b"\n</AppendedData>\n</VTKFile>\n"


def export_amber(
    trajectory: str | Path, target: str | Path, folded: bool = True, progress: Progress = None
) -> None:
    """Write a trajectory as AMBER's NetCDF-3, for readers that know neither HDF5 nor other units.

    The convention has one set of units, and so lengths are in angstrom, times in picoseconds and
    velocities in angstrom/picosecond, as large as they are: a grain of 25 micrometres is 250,000
    angstrom wide. Layout: AMBER NetCDF trajectory convention 1.0, ambermd.org/netcdf. Parameters
    and errors as those of `export_vtkhdf`.
    """
    with (
        _opened(trajectory) as run,
        atomic(target) as temporary,
        netCDF4.Dataset(temporary, "w", format="NETCDF3_64BIT_OFFSET") as file,
    ):
        units = run.in_units("angstrom", "picosecond", "angstrom/picosecond")
        file.setncatts({name: _short(value) for name, value in run.attributes.items()})
        for name, dimension in run.file.dimensions.items():
            file.createDimension(name, None if name == "frame" else dimension.size)
        for name, source in run.file.variables.items():
            # The convention has all but the cell in single precision.
            single = source.dtype.kind == "f" and not name.startswith("cell_")
            copy = file.createVariable(name, "f4" if single else source.dtype, source.dimensions)
            copy.setncatts(_described(source, units))
            if "frame" not in source.dimensions:
                copy[:] = _scaled(source, source[:], units)
        for k, frame in run.read(units, folded, progress):
            for name, values in frame.items():
                file[name][k] = values


class _Run(NamedTuple):
    """A trajectory that is open."""

    path: Path
    file: netCDF4.Dataset

    @property
    def frames(self) -> int:
        return self.file.dimensions["frame"].size

    @property
    def particles(self) -> int:
        return self.file.dimensions["atom"].size

    @property
    def attributes(self) -> dict:
        return {name: self.file.getncattr(name) for name in self.file.ncattrs()}

    def moving(self) -> list[str]:
        """Variables of each particle in each frame."""
        every = self.file.variables.items()
        return [name for name, variable in every if variable.dimensions[:2] == ("frame", "atom")]

    def in_units(self, length: str, time: str, velocity: str) -> Units:
        """The units of the run in others, from what the file says that they are in SI."""
        names = {"d_p": "diameter", "tau": "response_time", "v_s": "settling_velocity"}
        missing = [name for name in names.values() if name not in self.file.ncattrs()]
        if missing:
            raise ValueError(f"{self.path} does not say its {missing[0]} in SI")
        return {
            unit: (float(self.file.getncattr(name)) / IN_SI[other], other)
            for (unit, name), other in zip(names.items(), (length, time, velocity), strict=True)
        }

    def read(self, units: Units, folded: bool, progress: Progress) -> Iterator[tuple[int, dict]]:
        """Number and variables of each frame, in some units."""
        every = self.file.variables.items()
        moving = {name: source for name, source in every if "frame" in source.dimensions}
        for k in range(self.frames):
            frame = {name: source[k] for name, source in moving.items()}
            if folded:
                frame["coordinates"] = _folded(frame["coordinates"], frame["cell_lengths"])
            yield k, {name: _scaled(moving[name], frame[name], units) for name in frame}
            if progress is not None:
                progress(k + 1, self.frames)


@contextmanager
def _opened(trajectory: str | Path) -> Iterator[_Run]:
    with open_run(trajectory) as file:
        file.set_auto_chartostring(False)
        for name in ("time", "coordinates", "cell_lengths"):
            if name not in file.variables:
                raise ValueError(f"{trajectory} has no variable {name!r}: it is no trajectory")
        run = _Run(Path(trajectory), file)
        if run.frames == 0:
            raise ValueError(f"{trajectory} has no frame")
        yield run


def _scaled(variable, values, units: Units):
    """Values of a variable of the run in other units, in their own precision."""
    factor, _ = units.get(getattr(variable, "units", ""), (1.0, ""))
    return values if factor == 1.0 else (values * factor).astype(values.dtype)


def _described(variable, units: Units) -> dict:
    """Units and meaning of a variable."""
    found = {name: variable.getncattr(name) for name in variable.ncattrs()}
    kept = {name: found[name] for name in ("units", "long_name") if name in found}
    if kept.get("units") in units:
        kept["units"] = units[kept["units"]][1]
    return kept


def _short(value):
    """An attribute as NetCDF-3 holds it: whole numbers of 32 bits, longer ones as text."""
    whole = np.asarray(value)
    if whole.dtype.kind not in "iu":
        return value
    return whole.astype("i4") if np.abs(whole).max() <= LARGEST_INTEGER else str(value)


def _folded(position, box_length):
    """Positions within the cube; one that rounding puts on the far face belongs on the near one."""
    folded = (position - box_length * np.floor(position / box_length)).astype(position.dtype)
    return np.where(folded < box_length.astype(position.dtype), folded, 0)


def _like(group, name, variable, rows, units: Units):
    """An array for all frames of a variable, one after the other, with its units and meaning."""
    column = group.create_dataset(name, (rows, *variable.shape[2:]), variable.dtype)
    column.attrs.update(_described(variable, units))
    return column


def _write_cells(root, particles):
    """One vertex a particle; the other kinds of cells are empty."""
    root["NumberOfPoints"] = np.array([particles], "i8")
    for kind in CELL_KINDS:
        cells = particles if kind == "Vertices" else 0
        group = root.create_group(kind)
        group["NumberOfCells"] = np.array([cells], "i8")
        group["NumberOfConnectivityIds"] = np.array([cells], "i8")
        group["Connectivity"] = np.arange(cells, dtype="i8")
        group["Offsets"] = np.arange(cells + 1, dtype="i8")


def _write_steps(root, run: _Run, units: Units, names: list[str]):
    """Where each frame begins in each array; the cells are those of the first, always."""
    time = run.file["time"]
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = run.frames
    steps["Values"] = np.asarray(_scaled(time, time[:], units), "f8")
    steps["Values"].attrs["units"] = _described(time, units)["units"]
    steps["NumberOfParts"] = np.ones(run.frames, "i8")
    steps["PartOffsets"] = np.zeros(run.frames, "i8")
    beginning = run.particles * np.arange(run.frames, dtype="i8")
    steps["PointOffsets"] = beginning
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((run.frames, len(CELL_KINDS)), "i8")
    offsets = steps.create_group("PointDataOffsets")
    for name in names:
        offsets[name] = beginning
    offsets["particle"] = np.zeros(run.frames, "i8")
