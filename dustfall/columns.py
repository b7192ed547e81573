"""HDF5 files of columns, each with its units, its meaning, and a checksum of its content."""

import hashlib
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import NamedTuple

import numpy as np

from dustfall.extras import extra
from dustfall.files import atomic

with extra("files"):
    import h5py

DEFLATE = 1032
"""Most bytes that one of a packed file holds: those of deflate, which HDF5 packs by."""


class Column(NamedTuple):
    """What a column holds: units ("1" for plain numbers, "" for text and names), and in words."""

    units: str
    description: str


def write_columns(
    path: str | PathLike,
    columns: Mapping[str, Column],
    values: Mapping[str, object],
    attributes: Mapping[str, object] | None = None,
) -> None:
    """Write arrays as the datasets of an HDF5 file, with `attributes` of the whole file.

    Equal data give equal files: no time stamp goes in. Text is stored as bytes. Raises KeyError
    for a column without values.
    """
    with atomic(path) as temporary, h5py.File(temporary, "w", libver="v110") as file:
        file.attrs.update(attributes or {})
        for name, column in columns.items():
            array = np.asarray(values[name])
            if array.dtype.kind == "U":
                array = np.char.encode(array, "utf-8")
            stored = file.create_dataset(name, data=array, track_times=False)
            stored.attrs["units"] = column.units
            stored.attrs["description"] = column.description
            stored.attrs["sha256"] = _checksum(array)


def read_columns(
    path: str | PathLike, names: Iterable[str], optional: Iterable[str] = ()
) -> dict[str, np.ndarray]:
    """Read some columns of a file that `write_columns` wrote; text comes back as text.

    What is `optional` may be missing. Raises ValueError, with the name of the file, where it is
    damaged or lacks a column.
    """
    found = {}
    try:
        with h5py.File(path) as file:
            for name in (*names, *(name for name in optional if name in file)):
                array = own_column(file, name)[()]
                if file[name].attrs["sha256"] != _checksum(array):
                    raise ValueError(f"{name} does not match its checksum")
                text = array.dtype.kind == "S"
                found[name] = np.char.decode(array, "utf-8") if text else array
    except FileNotFoundError:
        raise
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise ValueError(
            f"{path} is damaged or no file of these columns ({error}); remove it, and run again "
            "what makes it"
        ) from error
    return found


def own_column(file: h5py.File, name: str, packing: int = 1) -> h5py.Dataset:
    """A column of numbers or text that lies in the file itself, so that its size bounds the memory.

    `packing` is how many bytes one of the file may hold. Raises ValueError for a link to another
    file or a part of one, for objects of any length, and for more than the file can hold.
    """
    link = file.get(name, getlink=True)
    if link is None:
        raise ValueError(f"it has no column {name}")
    column = file[name] if isinstance(link, h5py.HardLink) else None
    if (
        not isinstance(column, h5py.Dataset)
        or column.is_virtual
        or column.external
        or column.dtype.kind == "O"
        or column.nbytes > packing * file.id.get_filesize()
    ):
        raise ValueError(f"{name} is no plain column of it")
    return column


def started_checksum(dtype: np.dtype, shape: tuple[int, ...]):
    """SHA-256 of an array whose bytes are still to come, be it part by part."""
    return hashlib.sha256(f"{dtype.str} {shape}".encode())


def _checksum(array: np.ndarray) -> str:
    digest = started_checksum(array.dtype, array.shape)
    digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
