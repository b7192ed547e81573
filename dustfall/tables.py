"""Tables in files, text, npy or HDF5 by their suffix: the same columns and units in each.

Text has a line for each row, columns parted by commas or blanks, and comments after a #. Names may
be left out: then all columns have to be there, in order. The first quantity of a table is what its
rows are about: its components are x, y, z, and of several vectors x1, y1, z1, x2, and so on; those
of others carry their name, as in force_x. Units follow a name in brackets, `force_x [Re_p c_D]`,
and are checked where they are given. An npy file holds the first quantity alone, all columns side
by side, or a structured array; HDF5 a dataset for each quantity. Others than those asked for are
left alone, so that one command reads what another wrote, unless their names look misspelt.
"""

import difflib
import re
import sys
from collections.abc import Container, Mapping
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dustfall.extras import extra
from dustfall.files import atomic

SUFFIXES = (".csv", ".txt", ".npy", ".h5")

ALIKE = 0.75
"""Likeness, as difflib has it, from which on a name is taken for another one misspelt."""


class Quantity(NamedTuple):
    """What a table holds in each row: its shape, units and meaning.

    shape: () for a number, (3,) for a vector, (None, 3) for any number of vectors, the same in all
    rows. A table may lack a quantity that is not required.
    """

    shape: tuple[int | None, ...]
    units: str
    description: str
    required: bool = True


Quantities = Mapping[str, Quantity]


def read_table(path: str | PathLike, quantities: Quantities) -> dict[str, np.ndarray]:
    """Read quantities as float64 arrays (rows, *shape); those not required may be missing.

    Raises FileNotFoundError where there is no file, and ValueError, with its name, for a file of
    another kind, a quantity that is missing, misnamed, of another shape or in other units, and an
    empty table. Values that are not finite are left to who uses them.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    try:
        if path.suffix == ".h5":
            found = _read_hdf5(path, quantities)
        elif path.suffix == ".npy":
            found = _read_npy(path, quantities)
        else:
            found = _read_text(path, quantities)
        return _checked(found, quantities)
    except (ValueError, EOFError, OSError) as error:
        named = str(path) in str(error)
        raise ValueError(str(error) if named else f"{path}: {error}") from error


def write_table(
    path: str | PathLike | None, quantities: Quantities, values: Mapping[str, np.ndarray]
) -> None:
    """Write quantities (rows, *shape), atomically; without a path, as csv to standard output.

    Raises ValueError for another suffix.
    """
    rows = {name: np.asarray(values[name], dtype=float) for name in quantities}
    if path is None:
        _write_text(sys.stdout, quantities, rows)
        return
    check_suffix(path := Path(path))
    if path.suffix == ".h5":
        with extra("files"):
            from dustfall.columns import Column, write_columns
        columns = {name: Column(q.units, q.description) for name, q in quantities.items()}
        write_columns(path, columns, rows)
        return
    with atomic(path) as temporary:
        if path.suffix == ".npy":
            shapes = [(name, "f8", array.shape[1:]) for name, array in rows.items()]
            table = np.empty(len(next(iter(rows.values()))), shapes)
            for name, array in rows.items():
                table[name] = array
            np.save(temporary, table)
        else:
            with open(temporary, "w", encoding="utf-8") as file:
                _write_text(file, quantities, rows)


def check_suffix(path: str | PathLike) -> None:
    """Raise ValueError for a file whose suffix names no kind of table."""
    if Path(path).suffix not in SUFFIXES:
        raise ValueError(f"{path} is no table by its suffix: allowed are {', '.join(SUFFIXES)}")


def _labels(name: str, shape: tuple[int, ...], first: bool) -> list[str]:
    """Names of the components of a quantity in a csv file."""
    if not shape:
        return [name]
    vectors = [""] if len(shape) == 1 else [str(k + 1) for k in range(shape[0])]
    if first:
        return [f"{axis}{k}" for k in vectors for axis in "xyz"]
    return [f"{name}{k}_{axis}" for k in vectors for axis in "xyz"]


def _write_text(file, quantities: Quantities, rows: dict[str, np.ndarray]) -> None:
    header = [
        label if quantity.units == "1" else f"{label} [{quantity.units}]"
        for k, (name, quantity) in enumerate(quantities.items())
        for label in _labels(name, rows[name].shape[1:], first=k == 0)
    ]
    print(",".join(header), file=file)
    for row in np.column_stack([array.reshape(len(array), -1) for array in rows.values()]).tolist():
        print(",".join(map(repr, row)), file=file)


def _read_text(path: Path, quantities: Quantities) -> dict[str, np.ndarray]:
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    lines = [text for line in lines if (text := line.partition("#")[0].strip())]
    if not lines:
        raise ValueError("the table is empty")
    comma = "," if "," in lines[0] else None
    head = [name.strip() for name in lines[0].split(comma)]
    named = not all(map(_is_number, head))
    if named and len(lines) == 1:
        raise ValueError("the table has names, but no row")
    rows = np.loadtxt(lines[named:], delimiter=comma, ndmin=2)
    if not named:
        return _unnamed(rows, quantities)
    if len(head) != rows.shape[1]:
        raise ValueError(f"there are {len(head)} names for {rows.shape[1]} columns")
    return _named(head, rows, quantities)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _named(head: list[str], rows: np.ndarray, quantities: Quantities) -> dict[str, np.ndarray]:
    """Pick quantities from the columns by name; columns that nobody asks for are left alone."""
    units = {}
    for label in head:
        name, _, unit = label.partition("[")
        if name.strip() in units:
            raise ValueError(f"there are two columns {name.strip()}")
        units[name.strip()] = unit.strip().removesuffix("]").strip()
    place = {name: k for k, name in enumerate(units)}
    found = {}
    taken: list[str] = []
    for number, (name, quantity) in enumerate(quantities.items()):
        shape = quantity.shape
        count = 0
        while shape[:1] == (None,) and _labels(name, (count + 1, 3), number == 0)[-3] in place:
            count += 1
        whole = tuple(max(count, 1) if size is None else size for size in shape)
        labels = _labels(name, whole, number == 0)
        missing = [label for label in labels if label not in place]
        if len(missing) == len(labels) and not quantity.required:
            continue
        if missing:
            raise ValueError(f"there is no column {missing[0]} among {', '.join(place)}")
        for label in labels:
            if units[label] not in ("", quantity.units):
                raise ValueError(f"{label} is in {units[label]}: {quantity.units} is needed")
        found[name] = rows[:, [place[label] for label in labels]].reshape(len(rows), *whole)
        taken += labels
    left = [label for label in place if label not in taken]
    for label in left:
        if re.fullmatch(r"[xyz]\d+", label, re.IGNORECASE):
            raise ValueError(
                f"there is a column {label} beside {', '.join(taken)}: several vectors are "
                "numbered x1, y1, z1, x2, and so on, without a gap"
            )
    _refuse_misspelt(left, found, quantities, text=True)
    return found


def _refuse_misspelt(
    left: list[str], found: Container[str], quantities: Quantities, text: bool
) -> None:
    """Raise ValueError for a name that is left and looks like that of a quantity not found.

    As v_x for velocity_x does, or weights for weight; text has a name for each component.
    """
    for quantity, (shape, _, _, required) in quantities.items():
        if required or quantity in found:
            continue
        whole = tuple(1 if size is None else size for size in shape)
        labels = _labels(quantity, whole, first=False) if text else [quantity]
        for name in left:
            letters = re.sub("_?[xyz]$", "", name.lower()) if shape else ""
            short = letters != "" and quantity.startswith(letters)
            if short or difflib.get_close_matches(name.lower(), labels, 1, ALIKE):
                raise ValueError(
                    f"there is a column {name}, but no {quantity}: if it is that, "
                    f"{', '.join(labels)} is needed, else a name less alike"
                )


def _unnamed(rows: np.ndarray, quantities: Quantities) -> dict[str, np.ndarray]:
    """Take quantities from the columns in their order; those not required may end the table."""
    width, taken = rows.shape[1], 0
    fixed = {name: 3 if q.shape else 1 for name, q in quantities.items() if None not in q.shape}
    found = {}
    for name, quantity in quantities.items():
        if None in quantity.shape:
            rest = sum(fixed[other] for other in fixed if quantities[other].required)
            own = max(width - rest, 0) // 3 * 3
        else:
            own = fixed[name]
        if taken == width and not quantity.required:
            break
        if own == 0 or taken + own > width:
            break
        shape = tuple(own // 3 if size is None else size for size in quantity.shape)
        found[name] = rows[:, taken : taken + own].reshape(len(rows), *shape)
        taken += own
    if taken != width or any(q.required and name not in found for name, q in quantities.items()):
        raise ValueError(
            f"{width} columns without names are not {_in_words(quantities)}; give them names"
        )
    return found


def _read_npy(path: Path, quantities: Quantities) -> dict[str, np.ndarray]:
    # Mapped first: what claims to be longer than its file is refused, and takes no memory.
    array = np.array(np.load(path, mmap_mode="r", allow_pickle=False))
    if array.dtype.names:
        found = {name: array[name] for name in quantities if name in array.dtype.names}
        left = [name for name in array.dtype.names if name not in quantities]
        _refuse_misspelt(left, found, quantities, text=False)
        return found
    if array.ndim == 3:
        return {next(iter(quantities)): array}
    if array.ndim != 2:
        raise ValueError(f"an array {array.shape} is not {_in_words(quantities)}")
    return _unnamed(array, quantities)


def _read_hdf5(path: Path, quantities: Quantities) -> dict[str, np.ndarray]:
    with extra("files"):
        import h5py

        from dustfall.columns import DEFLATE, own_column, read_columns

    found, summed = {}, []
    with h5py.File(path) as file:
        left = [name for name in file if name not in quantities]
        _refuse_misspelt(left, set(file), quantities, text=False)
        for name, quantity in quantities.items():
            if name not in file:
                continue
            column = own_column(file, name, DEFLATE)
            units = column.attrs.get("units", "")
            if units not in ("", quantity.units):
                raise ValueError(f"{name} is in {units}: {quantity.units} is needed")
            if "sha256" in column.attrs:
                summed.append(name)
            else:
                found[name] = column[()]
    return {**found, **(read_columns(path, summed) if summed else {})}


def _checked(found: dict[str, np.ndarray], quantities: Quantities) -> dict[str, np.ndarray]:
    result = {}
    for name, quantity in quantities.items():
        if name not in found:
            if quantity.required:
                raise ValueError(f"there is no {name}: {_in_words(quantities)} are needed")
            continue
        array = np.ascontiguousarray(found[name], dtype=float)
        shape = tuple(
            given if size is None else size
            for size, given in zip(quantity.shape, array.shape[1:], strict=False)
        )
        if array.ndim == 0 or array.shape[1:] != shape or len(shape) != len(quantity.shape):
            raise ValueError(f"{name} is an array {array.shape}, not {_shape(quantity.shape)}")
        result[name] = array
    lengths = {len(array) for array in result.values()}
    if len(lengths) > 1:
        raise ValueError(f"the columns have different lengths: {', '.join(map(str, lengths))}")
    if lengths == {0}:
        raise ValueError("the table is empty")
    return result


def _shape(shape: tuple[int | None, ...]) -> str:
    return f"(rows{''.join(', k' if size is None else f', {size}' for size in shape)})"


def _in_words(quantities: Quantities) -> str:
    return ", ".join(
        f"{name} {_shape(quantity.shape)}{'' if quantity.required else ' if any'}"
        for name, quantity in quantities.items()
    )
