"""Scenes and forces that another solver or an experiment gave, from a CSV or an HDF5 file.

Columns of a CSV file, in any order: x1, y1, z1 to xk, yk, zk, the neighbours; force_x, force_y,
force_z, as `dustfall predict` writes them. Datasets of an HDF5 file: neighbours (m, k, 3), force
(m, 3). In d_p and Re_p c_D, which may follow a column's name in brackets, in the frame of the flow:
x spanwise, y streamwise, z vertical, the reference sphere at the origin; the neighbours of a scene
in any order. Either may have, of each scene, `volume_fraction` (without it, as k spheres have in
the ball that reaches to the farthest), `reynolds`, which models do not see, and `weight`, of a
scene in training.
"""

import re
from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from dustfall.columns import DEFLATE, own_column
from dustfall.dataset import OWN_LAW, Dataset, check
from dustfall.extras import extra
from dustfall.forces.frames import check_neighbours, sort_by_distance
from dustfall.scenes import volume_fraction
from dustfall.spheres import TOUCH, checked_numbers
from dustfall.units import CONTACT

with extra("files"):
    import h5py

FORCE = ("force_x", "force_y", "force_z")
OPTIONAL = ("volume_fraction", "reynolds", "weight")


def shape(path: str | PathLike) -> tuple[int, int]:
    """Numbers of scenes and of neighbours in a file, without reading all of it.

    Raises FileNotFoundError, and ValueError for a file without the columns, or with rows of more
    fields than its first line names.
    """
    path = Path(path)
    if path.suffix == ".csv":
        number = _neighbours_of(path, _table(path, nrows=1).columns)
        with open(path, "rb") as file:
            return sum(1 for line in file if line.strip()) - 1, number
    with _opened(path) as file:
        return file["neighbours"].shape[:2]


def read_own_data(path: str | PathLike) -> tuple[Dataset, np.ndarray | None]:
    """Read such a file: the data set, and the Reynolds numbers (m,) where it tells them.

    Raises FileNotFoundError, and ValueError with the file's name for a missing column, a shape that
    does not fit, a value that is not finite or out of range, a neighbour that overlaps the
    reference sphere, or a scene that occurs twice.
    """
    path = Path(path)
    columns = _read_csv(path) if path.suffix == ".csv" else _read_hdf5(path)
    try:
        return _dataset(columns)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _dataset(columns: Mapping[str, np.ndarray]) -> tuple[Dataset, np.ndarray | None]:
    neighbours = sort_by_distance(check_neighbours(columns["neighbours"]))
    number, k, _ = neighbours.shape
    if columns["force"].shape != (number, 3):
        raise ValueError(f"force has shape {columns['force'].shape}; it must be ({number}, 3)")
    for name in OPTIONAL:
        values = columns.get(name, np.ones(number))
        if values.shape != (number,) or not (np.isfinite(values) & (values > 0)).all():
            raise ValueError(f"{name} must be {number} finite values above 0, one a scene")
    _refuse_overlaps(neighbours)
    farthest = np.linalg.norm(neighbours[:, -1], axis=1)
    dataset = Dataset(
        neighbours=neighbours,
        force=columns["force"],
        volume_fraction=columns.get("volume_fraction", volume_fraction(farthest, k)),
        radial_law=np.full(number, OWN_LAW),
        scene=np.arange(number),
        weight=columns.get("weight"),
    )
    check(dataset)
    return dataset, columns.get("reynolds")


def _refuse_overlaps(neighbours: np.ndarray) -> None:
    """Raise ValueError that counts the neighbours nearer than contact, which models would move."""
    distance = np.linalg.norm(neighbours, axis=2)
    near = distance < CONTACT - TOUCH
    if near.any():
        hint = "; in units of a diameter: these look like metres" if near.all() else ""
        raise ValueError(
            f"{near.sum()} of {near.size} neighbours overlap the reference sphere, the nearest is "
            f"{distance.min():.3g} d_p from its centre: at least {CONTACT:g} is needed{hint}"
        )


def _read_csv(path: Path) -> dict[str, np.ndarray]:
    table = _table(path)
    number = _neighbours_of(path, table.columns)
    names = [f"{axis}{j}" for j in range(1, number + 1) for axis in "xyz"]
    used = [*names, *FORCE, *(name for name in OPTIONAL if name in table)]
    try:
        values = table[used].astype(float)
    except ValueError as error:
        raise ValueError(f"{path} holds what is no number: {error}") from None
    return {
        "neighbours": values[names].to_numpy().reshape(-1, number, 3),
        "force": values[list(FORCE)].to_numpy(),
        **{name: values[name].to_numpy() for name in OPTIONAL if name in values},
    }


def _table(path: Path, nrows: int | None = None) -> pd.DataFrame:
    try:
        table = pd.read_csv(path, nrows=nrows)
    except FileNotFoundError:
        raise FileNotFoundError(f"there is no file {path}") from None
    except ValueError as error:
        raise ValueError(f"{path} is no table: {error}") from None
    if not isinstance(table.index, pd.RangeIndex):
        # The first ones name the rows to pandas, and the others stand under the wrong columns.
        more = table.index.nlevels
        raise ValueError(
            f"{path} names {len(table.columns)} columns, but its rows have "
            f"{len(table.columns) + more} fields: one for each name is needed"
        )
    names = []
    for label in map(str, table.columns):
        name, _, found = label.partition(" [")
        units = "Re_p c_D" if name in FORCE else "1" if name in OPTIONAL else "d_p"
        if found not in ("", f"{units}]"):
            raise ValueError(f"{path} has {name} in {found.removesuffix(']')}: {units} is needed")
        names.append(name)
    return table.set_axis(names, axis=1)


def _neighbours_of(path: Path, names) -> int:
    """Number of neighbours that the columns of a table tell. Raises ValueError for others."""
    # Three digits are more than any model takes.
    found = [int(name[1:]) for name in names if re.fullmatch(r"x[1-9]\d{0,2}", name)]
    number = max(found, default=0)
    needed = [f"{axis}{j}" for j in range(1, max(number, 1) + 1) for axis in "xyz"]
    missing = [name for name in (*needed, *FORCE) if name not in names]
    unknown = [name for name in names if name not in (*needed, *FORCE, *OPTIONAL)]
    if missing:
        raise ValueError(f"{path} has no column {', '.join(missing)}")
    if unknown:
        raise ValueError(
            f"{path} has a column {unknown[0]}; allowed are x1, y1, z1 and so on, "
            f"{', '.join((*FORCE, *OPTIONAL))}"
        )
    return number


def _read_hdf5(path: Path) -> dict[str, np.ndarray]:
    with _opened(path) as file:
        names = [name for name in ("neighbours", "force", *OPTIONAL) if name in file]
        try:
            return {
                name: checked_numbers(name, own_column(file, name, DEFLATE)[()]) for name in names
            }
        except (OSError, RuntimeError, KeyError, ValueError) as error:
            raise ValueError(f"{path} is damaged or no file of such columns ({error})") from None


def _opened(path: Path) -> h5py.File:
    """The open file. Raises ValueError where it is none, or lacks neighbours or forces."""
    try:
        file = h5py.File(path)
    except FileNotFoundError:
        raise FileNotFoundError(f"there is no file {path}") from None
    except OSError as error:
        raise ValueError(f"{path} is neither CSV (.csv) nor readable HDF5: {error}") from None
    for name, axes in (("neighbours", 3), ("force", 2)):
        if not isinstance(file.get(name), h5py.Dataset) or file[name].ndim != axes:
            file.close()
            raise ValueError(f"{path} has no dataset {name} with {axes} axes")
    return file
