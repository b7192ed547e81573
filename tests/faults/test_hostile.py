"""Files from a stranger: nothing in them runs, and whatever they claim, they are read or refused.

Each test takes a few inputs in `make test` and thousands in `make fault-test`.
"""

import hashlib
import json
import os
import pickle
from io import BytesIO

import h5py
import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from dustfall.columns import Column, read_columns, write_columns
from dustfall.forces import learned
from dustfall.forces.learned import SHIPPED, load_model
from dustfall.own_data import read_own_data
from dustfall.sedimentation.start import read_start
from tests.faults.conftest import count
from tests.sedimentation.runs import run
from workflow.configuration import ConfigurationError, configure, keys, load_schema, read_file

FEW, MANY = 25, int(os.environ.get("FAULT_INPUTS", "2000"))

QUIET = {
    "deadline": None,
    "derandomize": True,
    "database": None,
    "suppress_health_check": list(HealthCheck),
}


def edits(whole: bytes):
    """Copies of a file with bytes put in, left out or written over at some places."""
    place = st.integers(0, len(whole))
    edit = st.tuples(place, st.integers(0, 300), st.binary(max_size=300))

    def apply(changes):
        content = whole
        for start, length, put in changes:
            content = content[:start] + put + content[start + length :]
        return content

    return st.lists(edit, min_size=1, max_size=3).map(apply)


def tried(ledger, fault: str, inputs, outcome_of, number: int) -> None:
    """Draw inputs and enter what became of each."""
    outcomes = []

    @settings(max_examples=number, **QUIET)
    @given(inputs)
    def each(drawn):
        try:
            outcomes.append(outcome_of(drawn))
        except (ValueError, FileNotFoundError) as error:
            words = str(error)
            outcomes.append("detected" if "\n" not in words else f"crashed ({words})")
        except Exception as error:
            outcomes.append(f"crashed ({type(error).__name__}: {error}, from {drawn!r:.200})")

    each()
    count(ledger, fault, outcomes)


SOME_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=6,
)


def models(path):
    """Model files with any entry of the header, or any tensor, changed, and sealed as if right."""
    with safe_open(SHIPPED, framework="numpy") as file:
        header = json.loads(file.metadata()["header"])
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    header.pop("checksum")
    odd = st.sampled_from(
        [-1, 0, 6, 50, 10**30, 1e308, float("inf"), float("nan"), "", "10/" * 999, True, None, []]
    )
    name = st.sampled_from(sorted(tensors))
    shape = st.lists(st.integers(0, 8), max_size=3).map(tuple)
    kind = st.sampled_from(["f4", "f8", "i8", "u1", "f2"])

    def write(drawn):
        key, value, tensor, dims, dtype, what = drawn
        own, arrays = dict(header), dict(tensors)
        if what != "tensor":
            own[key] = value
        if what != "header":
            arrays[tensor] = np.full(dims, np.nan if dtype[0] == "f" else 1).astype(dtype)
        own["checksum"] = learned._checksum(own, arrays)
        save_file(arrays, path, {"header": json.dumps(own)})
        return path

    drawn = st.tuples(
        st.sampled_from(sorted(header)), odd | SOME_JSON, name, shape, kind,
        st.sampled_from(["header", "tensor", "both"]),
    )  # fmt: skip
    return drawn, write


NEIGHBOURS = np.random.default_rng(0).normal(scale=4.0, size=(5, 50, 3))


def hostile_models(ledger, tmp_path, number, title):
    drawn, write = models(tmp_path / "model.safetensors")

    def predict(parts):
        model = load_model(write(parts))
        model.predict(NEIGHBOURS[:, : model.neighbours])
        return "harmless"

    tried(ledger, title, drawn, predict, number)


def hostile_bytes(ledger, tmp_path, number, title):
    path = tmp_path / "model.safetensors"

    def predict(content):
        path.write_bytes(content)
        load_model(path).predict(NEIGHBOURS[:, :5])
        return "harmless" if content == SHIPPED.read_bytes() else "silent"

    tried(ledger, title, edits(SHIPPED.read_bytes()), predict, number)


COLUMNS = {"force": Column("1", "a column"), "scene": Column("1", "another")}


def hostile_columns(ledger, tmp_path, number, title):
    path, values = tmp_path / "data.h5", {"force": np.arange(300.0), "scene": np.arange(9)}
    write_columns(path, COLUMNS, values)
    whole = path.read_bytes()

    def read(content):
        path.write_bytes(content)
        found = read_columns(path, COLUMNS)
        same = all(np.array_equal(found[name], values[name]) for name in COLUMNS)
        return "harmless" if same else "silent"

    tried(ledger, title, edits(whole), read, number)


def hostile_trajectories(ledger, tmp_path, number, title):
    run(tmp_path, particles=40, duration=0.5)
    path = tmp_path / "case.nc"
    whole = path.read_bytes()
    expected = read_start(path, 40, 1e-3)

    def read(content):
        path.write_bytes(content)
        found = read_start(path, 40, 1e-3)
        same = all(np.array_equal(a, b) for a, b in zip(found, expected, strict=True))
        return "harmless" if same else "silent"

    tried(ledger, title, edits(whole), read, number)


def hostile_tables(ledger, tmp_path, number, title):
    path = tmp_path / "start.txt"
    number_like = st.floats() | st.integers(-(10**40), 10**40) | st.text(max_size=5)
    row = st.lists(number_like, min_size=1, max_size=7).map(lambda row: " ".join(map(str, row)))
    content = st.lists(row, max_size=8).map("\n".join).map(str.encode) | st.binary(max_size=200)

    def read(drawn):
        path.write_bytes(drawn.replace(b"\r", b""))
        positions, velocities = read_start(path, 2, 1e-3)
        assert np.isfinite(positions).all()
        assert velocities is None or np.abs(velocities).max() <= 100
        return "harmless"

    tried(ledger, title, content, read, number)


def hostile_settings(ledger, tmp_path, number, title):
    path = tmp_path / "mine.yaml"
    known = keys(load_schema())

    def nested(pair):
        key, value = pair
        for part in reversed(key.split(".")):
            value = {part: value}
        return yaml.safe_dump(value, allow_unicode=True).encode("utf-8", "surrogatepass")

    settings_ = st.tuples(st.sampled_from(sorted(known)), SOME_JSON).map(nested)
    content = settings_ | SOME_JSON.map(json.dumps).map(str.encode) | st.binary(max_size=100)

    def read(drawn):
        path.write_bytes(drawn)
        try:
            configure(read_file(path))
        except ConfigurationError:
            return "detected"
        except ValueError as error:
            return f"crashed ({error}, from {drawn!r:.200})"
        return "harmless"

    tried(ledger, title, content, read, number)


HOSTILE = {
    "a stranger's model file, sealed": hostile_models,
    "a stranger's model file, bytes": hostile_bytes,
    "a stranger's data file": hostile_columns,
    "a stranger's trajectory": hostile_trajectories,
    "a stranger's table of positions": hostile_tables,
    "a stranger's configuration": hostile_settings,
}


@pytest.mark.parametrize("title", HOSTILE)
def test_a_strangers_file_is_read_or_refused(ledger, tmp_path, title):
    HOSTILE[title](ledger, tmp_path, FEW, f"a few of {title}")


@pytest.mark.faults
@pytest.mark.parametrize("title", HOSTILE)
def test_many_of_a_strangers_files_are_read_or_refused(ledger, tmp_path, title):
    HOSTILE[title](ledger, tmp_path, MANY, title)


class Trap:
    """What runs a command where a reader unpickles it."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def test_nothing_in_a_file_runs(tmp_path):
    trap, bait = tmp_path / "sprung", pickle.dumps(Trap(tmp_path / "sprung"))
    for name in ("model.safetensors", "data.h5", "case.nc", "start.txt", "mine.yaml"):
        (tmp_path / name).write_bytes(bait)
    np.savez(tmp_path / "objects.npz", a=np.array([Trap(trap)], dtype=object))
    seal = hashlib.sha256((tmp_path / "objects.npz").read_bytes()).hexdigest()
    (tmp_path / "c").mkdir()
    sealed = f"{seal}\n".encode() + (tmp_path / "objects.npz").read_bytes()
    (tmp_path / "c/state.bin").write_bytes(sealed)
    (tmp_path / "tagged.yaml").write_text(f"a: !!python/object/apply:os.mkdir [{trap}]")
    (tmp_path / "template.yaml").write_text(
        f"__use_yte__: true\na: ?__import__('os').mkdir('{trap}')"
    )
    for read in (
        lambda: load_model(tmp_path / "model.safetensors"),
        lambda: read_columns(tmp_path / "data.h5", COLUMNS),
        lambda: read_start(tmp_path / "case.nc", 40, 1e-3),
        lambda: read_start(tmp_path / "start.txt", 40, 1e-3),
        lambda: read_file(tmp_path / "mine.yaml"),
        lambda: read_file(tmp_path / "tagged.yaml"),
        lambda: read_file(tmp_path / "template.yaml"),
        lambda: run(tmp_path, particles=40, checkpoint=tmp_path / "c"),
    ):
        with pytest.raises(ValueError):  # noqa: PT011 - which one is other tests' question
            read()
    assert not trap.exists()


def linked(file, other):
    file["force"] = h5py.ExternalLink(other, "force")


def stored_elsewhere(file, other):
    file.create_dataset("force", (10,), "f8", external=[(str(other), 0, 80)])


def virtual(file, other):
    layout = h5py.VirtualLayout((300,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "force", (300,))
    file.create_virtual_dataset("force", layout)


def claimed(file, other):
    file.create_dataset("force", (10**12,), "f8", chunks=(1000,))


def packed(file, other):
    file.create_dataset("force", data=np.zeros(10**7), compression="gzip")


def objects(file, other):
    file.create_dataset("force", data=["a"] * 3, dtype=h5py.string_dtype())


@pytest.mark.parametrize("trick", [linked, stored_elsewhere, virtual, claimed, packed, objects])
def test_a_data_file_takes_nothing_from_elsewhere_and_no_more_memory_than_it_has(tmp_path, trick):
    path, other = tmp_path / "data.h5", tmp_path / "other.h5"
    write_columns(other, {"force": COLUMNS["force"]}, {"force": np.arange(300.0)})
    with h5py.File(path, "w") as file:
        trick(file, other)
    with pytest.raises(ValueError, match=r"data\.h5 .*force is no plain column of it"):
        read_columns(path, ["force"])


@pytest.mark.parametrize(
    "header", ["[" * 100_000, "9" * 5000, "\\u0000", '{"format": "dustfall force model"}']
)
def test_a_model_whose_header_is_no_header_is_refused(tmp_path, header):
    path = tmp_path / "model.safetensors"
    save_file({"a": np.zeros(3)}, path, {"header": header})
    with pytest.raises(ValueError, match=r"model\.safetensors"):
        load_model(path)


def test_a_model_file_that_is_too_large_is_refused_unread(tmp_path):
    path = tmp_path / "model.safetensors"
    with open(path, "wb") as file:
        file.truncate(2**40)
    with pytest.raises(ValueError, match="1099511627776 bytes: allowed are"):
        load_model(path)


def npy_header(shape) -> bytes:
    file = BytesIO()
    form = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, form)
    return file.getvalue()


def test_own_data_that_claim_too_much_are_refused_unread(tmp_path):
    table, packed = tmp_path / "own.csv", tmp_path / "own.h5"
    table.write_text("x999999999,fx,fy,fz\n1,2,3,4\n")
    with pytest.raises(ValueError, match=r"own\.csv has no column x1, "):
        read_own_data(table)
    claim = tmp_path / "own.npy"
    claim.write_bytes(npy_header((10**12, 3)))
    with pytest.raises(ValueError, match=r"own\.npy"):
        read_start(claim, None, 1e-3)
    with h5py.File(tmp_path / "start.h5", "w") as file:
        file.create_dataset("position", (10**12, 3), "f8", chunks=(1000, 3))
    with pytest.raises(ValueError, match=r"start\.h5: position is no plain column of it"):
        read_start(tmp_path / "start.h5", None, 1e-3)
    with h5py.File(packed, "w") as file:
        file.create_dataset("neighbours", (10**9, 5, 3), "f8", chunks=(1000, 5, 3))
        file.create_dataset("force", (10**9, 3), "f8", chunks=(1000, 3))
    with pytest.raises(ValueError, match=r"own\.h5 .*neighbours is no plain column of it"):
        read_own_data(packed)
