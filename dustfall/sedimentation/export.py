"""A trajectory as ParaView opens it: VTKHDF, one file with all its frames."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from dustfall.extras import extra
from dustfall.files import atomic
from dustfall.sedimentation.trajectory import open_run

with extra("files"):
    import h5py

VERSION = (2, 0)
"""Of the VTKHDF format: the first with polygonal data that change in time (ParaView 5.12)."""

CELL_KINDS = ("Vertices", "Lines", "Polygons", "Strips")
"""Groups of cells that a reader expects of polygonal data, in this order."""


def export_vtkhdf(
    trajectory: str | Path,
    target: str | Path,
    folded: bool = True,
    progress: Callable[[int, int], None] | None = None,
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
    progress : called with the number of frames done and of all frames

    Raises
    ------
    FileNotFoundError : there is no trajectory.
    ValueError : the file is damaged, lacks a variable of a trajectory, or has no frame.
    """
    with open_run(trajectory) as source:
        for name in ("time", "coordinates", "cell_lengths"):
            if name not in source.variables:
                raise ValueError(f"{trajectory} has no variable {name!r}: it is no trajectory")
        frames, particles = (source.dimensions[name].size for name in ("frame", "atom"))
        if frames == 0:
            raise ValueError(f"{trajectory} has no frame")
        with atomic(target) as temporary, h5py.File(temporary, "w") as file:
            run = file.create_group("run")
            run.attrs.update({name: source.getncattr(name) for name in source.ncattrs()})
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = np.array(VERSION, "i8")
            # Readers take a string of fixed length alone.
            root.attrs.create("Type", np.bytes_("PolyData"))
            _write_cells(root, particles)
            names = [
                name
                for name, variable in source.variables.items()
                if variable.dimensions[:2] == ("frame", "atom") and name != "coordinates"
            ]
            _write_steps(root, source["time"], frames, particles, names)
            points = _like(root, "Points", source["coordinates"], frames * particles)
            data = root.create_group("PointData")
            columns = {name: _like(data, name, source[name], frames * particles) for name in names}
            data["particle"] = np.arange(particles, dtype="i4")
            for k in range(frames):
                rows = slice(k * particles, (k + 1) * particles)
                position = source["coordinates"][k]
                if folded:
                    position = _folded(position, source["cell_lengths"][k])
                points[rows] = position
                for name, column in columns.items():
                    column[rows] = source[name][k]
                if progress is not None:
                    progress(k + 1, frames)


def _folded(position, box_length):
    """Positions within the cube; one that rounding puts on the far face belongs on the near one."""
    folded = (position - box_length * np.floor(position / box_length)).astype(position.dtype)
    return np.where(folded < box_length.astype(position.dtype), folded, 0)


def _like(group, name, variable, rows):
    """An array for all frames of a variable, one after the other, with its units and meaning."""
    column = group.create_dataset(name, (rows, *variable.shape[2:]), variable.dtype)
    column.attrs.update({name: variable.getncattr(name) for name in variable.ncattrs()})
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


def _write_steps(root, time, frames, particles, names):
    """Where each frame begins in each array; the cells are those of the first, always."""
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = frames
    steps["Values"] = np.asarray(time[:], "f8")
    steps["Values"].attrs["units"] = time.units
    steps["NumberOfParts"] = np.ones(frames, "i8")
    steps["PartOffsets"] = np.zeros(frames, "i8")
    beginning = particles * np.arange(frames, dtype="i8")
    steps["PointOffsets"] = beginning
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((frames, len(CELL_KINDS)), "i8")
    offsets = steps.create_group("PointDataOffsets")
    for name in names:
        offsets[name] = beginning
    offsets["particle"] = np.zeros(frames, "i8")
