"""Readers take a whole file and refuse any other with a sentence."""

import json
import zlib

import numpy as np
import pytest

from dustfall.forces import load_model
from dustfall.forces.export import _bytes, export_json, export_openfoam, exported
from tests.cpp.conftest import random_model
from tests.forces.scenes import random_neighbours


@pytest.fixture(scope="module")
def document():
    return exported(random_model("anchored"))


@pytest.fixture
def refusal(library, tmp_path):
    """A function that returns the sentence with which a changed document is refused."""

    def refusal(document, seal=True):
        if seal:
            rest = {key: value for key, value in document.items() if key != "checksum"}
            document = rest | {"checksum": zlib.crc32(b"".join(_bytes(rest)))}
        (tmp_path / "model.json").write_text(json.dumps(document))
        with pytest.raises(ValueError) as error:  # noqa: PT011 - the caller reads the sentence
            library.load(tmp_path / "model.json")
        return str(error.value)

    return refusal


def test_both_formats_hold_the_same_entries(tmp_path):
    model = load_model()
    export_json(model, tmp_path / "model.json")
    export_openfoam(model, tmp_path / "model")
    document = json.loads((tmp_path / "model.json").read_text())
    dictionary = (tmp_path / "model").read_text().split("}", 1)[1]
    for brace in "(){};":
        dictionary = dictionary.replace(brace, " ")
    flat = []

    def flatten(entries):
        for key, value in entries.items():
            flat.append(key)
            if isinstance(value, dict):
                flatten(value)
            else:
                flat.extend(map(json.dumps, value if isinstance(value, list) else [value]))

    flatten(document)
    assert dictionary.replace(f'"{document["format"]}"', "FORMAT").split() == [
        "FORMAT" if word == f'"{document["format"]}"' else word for word in flat
    ]


def test_the_hash_tells_models_apart(document):
    assert document["sha256"] == exported(random_model("anchored"))["sha256"]
    assert document["sha256"] != exported(random_model("anchored", largest_distance=61.0))["sha256"]


def test_every_damaged_byte_is_noticed_or_harmless(library, tmp_path):
    path = tmp_path / "model.json"
    model = random_model("anchored")
    export_json(model, path)
    whole = path.read_bytes()
    scenes = random_neighbours(20)
    expected = model.predict(scenes)
    rng = np.random.default_rng(0)
    refused = 0
    for place in rng.integers(0, len(whole), 400):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(0, 7)
        path.write_bytes(damaged)
        try:
            loaded = library.load(path)
        except ValueError:
            refused += 1
        else:
            np.testing.assert_allclose(library.predict(loaded, scenes), expected, atol=1e-9)
    assert refused > 300


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.9, 0.9999])
def test_half_a_file_is_refused(kept, document, library, tmp_path):
    path = tmp_path / "model.json"
    text = json.dumps(document)
    path.write_text(text[: int(kept * len(text))])
    with pytest.raises(ValueError, match="damaged or no JSON"):
        library.load(path)


def test_a_missing_file_is_named(library, tmp_path):
    with pytest.raises(ValueError, match=f"there is no file {tmp_path}/nothing.json"):
        library.load(tmp_path / "nothing.json")


def test_another_format_or_version_is_named(document, refusal):
    assert "holds no dustfall exported force model" in refusal(document | {"format": "other"})
    assert "has version 2, and this reader knows 1" in refusal(document | {"version": 2})


def test_forces_that_are_not_reproduced_are_refused(document, refusal):
    forces = list(document["test_forces"])
    forces[7] += 1e-6
    assert "test scene, number 2" in refusal(document | {"test_forces": forces})


def test_weights_that_do_not_match_their_checksum_are_refused(document, refusal):
    network = dict(document["streamwise"])
    network["unit"] *= 1 + 1e-15
    assert "checksum" in refusal(document | {"streamwise": network}, seal=False)


@pytest.mark.parametrize(
    ("entry", "value", "sentence"),
    [
        ("neighbours", 0, "neighbours 0: whole numbers from 1"),
        ("neighbours", 2.5, "neighbours 2.5"),
        ("order", "size", "order size: distance or given"),
        ("frame", "box", "frame box: canonical or flow"),
        ("baseline", "none", "another layout"),
        ("block_inputs", [0, 0, 6], "block_inputs 6"),
        ("block_inputs", [0, 0, 2, 1, 2], "layout"),
        ("largest_distance", -1.0, "another layout"),
        ("test_scenes", [1.0, 2.0, 3.0], "another layout"),
        ("test_forces", [], "another layout"),
        ("correction", [1.0, 2.0, 3.0], "another layout"),
    ],
)
def test_entries_out_of_range_are_refused(entry, value, sentence, document, refusal):
    assert sentence in refusal(document | {entry: value})


def test_networks_of_another_layout_are_refused(document, refusal):
    block = document["lateral"]["block0"]
    for change in (
        {"widths": block["widths"][:1]},
        {"widths": [3, *block["widths"][1:]]},
        {"widths": [*block["widths"][:-1], 1]},
        {"parameters": block["parameters"][:-1]},
    ):
        network = document["lateral"] | {"block0": block | change}
        assert "networks do not have the layout" in refusal(document | {"lateral": network})


@pytest.mark.parametrize(
    "entry", ["sha256", "neighbours", "block_inputs", "streamwise", "test_forces"]
)
def test_a_missing_entry_is_named(entry, document, refusal):
    rest = {key: value for key, value in document.items() if key != entry}
    assert f"has no {entry}" in refusal(rest)
