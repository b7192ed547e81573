import json
import subprocess
import sys

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.numpy import save_file
from safetensors.torch import save_file as save_torch

from dustfall.forces import learned, load_model
from dustfall.forces.features import COMPONENTS, describe
from dustfall.forces.formulas.reflections import MODEL as REFLECTED
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.forces.learned import VERSION, multiplications, parse_layers
from dustfall.training import TrainingSettings, train_model
from dustfall.training.networks import build
from tests.forces.scenes import LAYERS, random_neighbours

KINDS = list(LAYERS)


@pytest.mark.parametrize("kind", KINDS)
def test_compiled_network_equals_pytorch(models, kind):
    model = models[kind]
    header = model.header
    neighbours = random_neighbours(333, seed=5)
    scenes = describe(kind, neighbours, header["radial_input"], header["largest_distance"])
    for component, network in model.networks.items():
        module = build(
            kind, header["layers"][component], component, 5, [torch.Generator()]
        ).double()
        weights = [array for block in network.blocks for layer in block for array in layer]
        with torch.no_grad():
            for parameter, array in zip(module.parameters(), weights, strict=True):
                parameter.copy_(torch.from_numpy(array.T.reshape(parameter.shape)))
            inputs = torch.from_numpy((scenes.inputs - network.mean) / network.scale)[None]
            output = module(inputs, torch.from_numpy(scenes.envelope)[None])
            expected = network.unit * output[0].numpy()
        compiled = network.residual(scenes.inputs, scenes.envelope)
        np.testing.assert_allclose(compiled, expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize(("kind", "number"), [("pairwise", 1), ("idnn", 3), ("anchored", 8)])
def test_models_of_another_number_of_neighbours_are_trained_saved_and_held_to_it(
    tmp_path, kind, number
):
    neighbours = random_neighbours(60, number=number)
    force = REFLECTED.predict(neighbours)
    layers = "6/4" if kind != "pairwise" else "6"
    model = train_model(kind, neighbours, force, layers, TrainingSettings(epochs=1))
    model.save(tmp_path / "model.safetensors")
    loaded = load_model(tmp_path / "model.safetensors")
    assert loaded.neighbours == number
    np.testing.assert_array_equal(loaded.predict(neighbours), model.predict(neighbours))
    with pytest.raises(ValueError, match=f"k = {number}"):
        loaded.predict(random_neighbours(4, number=number + 1))


def test_a_decomposed_network_refuses_too_few_neighbours():
    with pytest.raises(ValueError, match="2 neighbours: a decomposed network needs at least 3"):
        train_model("idnn", random_neighbours(20, number=2), np.ones((20, 3)), "6/4")


@pytest.mark.parametrize("kind", KINDS)
def test_a_scene_has_the_same_force_in_any_batch(models, kind):
    neighbours = random_neighbours(150)
    together = models[kind].predict(neighbours)
    alone = np.concatenate([models[kind].predict(scene[None]) for scene in neighbours])
    np.testing.assert_array_equal(together, alone)


@pytest.mark.parametrize("kind", ["dense_sorted", "pairwise", "idnn", "anchored"])
def test_order_of_neighbours_does_not_matter(models, kind):
    neighbours = random_neighbours(50)
    expected = models[kind].predict(neighbours)
    shuffled = models[kind].predict(neighbours[:, [1, 4, 0, 3, 2]])
    np.testing.assert_array_equal(shuffled, expected)


def test_anchored_force_turns_with_the_scene_about_the_flow_axis(models):
    neighbours = random_neighbours(100)
    force = models["anchored"].predict(neighbours)
    for turn in (1e-3, 0.5, 2.0, np.pi):
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        turned = models["anchored"].predict(neighbours @ rotation.T)
        np.testing.assert_allclose(turned, force @ rotation.T, atol=1e-10)


@pytest.mark.parametrize("mirror", [[-1, 1, 1], [1, 1, -1]])
def test_anchored_force_is_mirrored_with_the_scene(models, mirror):
    neighbours = random_neighbours(100)
    force = models["anchored"].predict(neighbours)
    mirrored = models["anchored"].predict(neighbours * mirror)
    np.testing.assert_allclose(mirrored, force * mirror, atol=1e-10)


def test_anchored_force_stays_when_the_scene_is_inverted(models):
    neighbours = random_neighbours(100)
    force = models["anchored"].predict(neighbours)
    np.testing.assert_allclose(models["anchored"].predict(-neighbours), force, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_neighbours_closer_than_contact_are_held_at_contact(models, kind):
    neighbours = random_neighbours(20)
    neighbours[:, 0] /= np.linalg.norm(neighbours[:, 0], axis=1, keepdims=True)
    expected = models[kind].predict(neighbours)
    neighbours[:, 0] *= 0.4
    np.testing.assert_allclose(models[kind].predict(neighbours), expected, atol=1e-10)


@pytest.mark.parametrize("kind", KINDS)
def test_force_goes_over_into_stokes_drag_beyond_the_trained_range(models, kind):
    largest = models[kind].header["largest_distance"]
    direction = random_neighbours(20)
    # Slightly different distances, so that rounding does not change the order of the neighbours.
    direction *= (1 + 0.01 * np.arange(5)[:, None]) / np.linalg.norm(
        direction, axis=2, keepdims=True
    )
    sizes = largest * np.array([1.0, 1.0 + 1e-9, 2.0, 10.0, 100.0, 1e6])
    deviation = np.array(
        [np.abs(models[kind].predict(size * direction) - [0, 24, 0]).max() for size in sizes]
    )
    assert abs(deviation[1] - deviation[0]) < 1e-6
    np.testing.assert_allclose(deviation[2:] * sizes[2:], deviation[2] * sizes[2], rtol=0.2)


def test_residual_of_the_anchored_model_fades_far_away(models):
    neighbours = random_neighbours(20)
    difference = models["anchored"].predict(1e5 * neighbours) - ROTNE_PRAGER.predict(
        1e5 * neighbours
    )
    assert np.abs(difference).max() < 1e-4


@pytest.mark.parametrize("kind", KINDS)
def test_saved_model_predicts_the_same_bits(models, kind, tmp_path):
    path = tmp_path / "model.safetensors"
    models[kind].save(path)
    loaded = load_model(path)
    neighbours = random_neighbours(100)
    np.testing.assert_array_equal(loaded.predict(neighbours), models[kind].predict(neighbours))
    assert loaded.header == json.loads(json.dumps(models[kind].header))
    again = tmp_path / "again.safetensors"
    loaded.save(again)
    assert again.read_bytes() == path.read_bytes()


def test_prediction_from_a_file_needs_no_pytorch(models, tmp_path):
    path = tmp_path / "model.safetensors"
    models["anchored"].save(path)
    code = (
        "import sys, numpy; from dustfall.forces import load_model;"
        f"load_model({str(path)!r}).predict(numpy.eye(5, 3)[None] + 2);"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def rewritten(path, change):
    with safe_open(path, framework="numpy") as file:
        header = json.loads(file.metadata()["header"])
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    header.pop("checksum")
    change(header, tensors)
    header["checksum"] = learned._checksum(header, tensors)
    save_file(tensors, path, {"header": json.dumps(header)})


def test_damaged_files_are_refused(models, tmp_path):
    path = tmp_path / "model.safetensors"
    models["idnn"].save(path)
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[-100] ^= 1
    # One digit of the header, which is as good a number as before.
    other = whole.replace(b'largest_distance\\": 3', b'largest_distance\\": 4')
    assert other != whole
    for damaged in (whole[:-10], whole[:20], b"", b"no model at all", bytes(flipped), other):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="damaged"):
            load_model(path)


def test_files_of_another_version_are_refused(models, tmp_path):
    path = tmp_path / "model.safetensors"
    models["idnn"].save(path)
    rewritten(path, lambda header, tensors: header.update(version=1))
    with pytest.raises(ValueError, match=f"format version 1; this dustfall reads {VERSION}"):
        load_model(path)


def test_files_of_another_layout_are_refused(models, tmp_path):
    path = tmp_path / "model.safetensors"
    for change in (
        lambda header, tensors: header["layers"].update(lateral="24-24/16-17"),
        lambda header, tensors: header.update(kind="dense"),
        lambda header, tensors: header.update(kind="pairs"),
        lambda header, tensors: header.pop("layers"),
        lambda header, tensors: header.update(largest_distance="far"),
        lambda header, tensors: header.update(largest_distance=10**30),
        lambda header, tensors: header.update(neighbours=0),
    ):
        models["idnn"].save(path)
        rewritten(path, change)
        with pytest.raises(ValueError, match="another layout"):
            load_model(path)


def test_files_that_hold_something_else_are_refused(tmp_path):
    path = tmp_path / "other.safetensors"
    save_file({"a": np.zeros(3)}, path)
    with pytest.raises(ValueError, match="holds no dustfall force model"):
        load_model(path)


@pytest.mark.parametrize(
    "kind", [torch.bfloat16, torch.float8_e4m3fn, torch.float8_e5m2, torch.int32]
)
def test_numbers_of_other_types_are_refused(tmp_path, kind):
    path = tmp_path / "other.safetensors"
    save_torch({"a": torch.zeros(3, dtype=kind)}, path)
    with pytest.raises(ValueError, match=r"other\.safetensors holds numbers of \w+, not F32"):
        load_model(path)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no file .*missing\.safetensors"):
        load_model(tmp_path / "missing.safetensors")


def test_missing_shipped_model_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("dustfall.forces.learned.SHIPPED", tmp_path / "anchored.safetensors")
    with pytest.raises(FileNotFoundError, match="anchored model that ships with dustfall"):
        load_model()


@pytest.mark.parametrize("kind", KINDS)
def test_empty_batch_gives_no_forces(models, kind):
    assert models[kind].predict(np.empty((0, 5, 3))).shape == (0, 3)


@pytest.mark.parametrize("kind", KINDS)
def test_neighbours_of_another_shape_or_not_finite_are_refused(models, kind):
    with pytest.raises(ValueError, match="shape"):
        models[kind].predict(np.ones((3, 4, 3)))
    with pytest.raises(ValueError, match="not finite"):
        models[kind].predict(np.full((1, 5, 3), np.nan))


@pytest.mark.parametrize(
    ("layers", "kind"),
    [("40-40", "idnn"), ("40/30", "dense"), ("40-0/30", "idnn"), ("", "dense"), (40, "dense")],
)
def test_layers_that_do_not_fit_the_kind_are_refused(layers, kind):
    with pytest.raises(ValueError, match="layers is"):
        parse_layers(layers, kind)


def test_multiplications_count_every_use_of_a_block():
    # Two nearest neighbours: 6-40-40-1; each of the other three: 3-30-30-30-1.
    expected = (6 * 40 + 40 * 40 + 40) + 3 * (3 * 30 + 2 * 30 * 30 + 30)
    assert multiplications("idnn", "40-40/30-30-30", "streamwise") == expected
    assert multiplications("dense", "8", "lateral") == 15 * 8 + 8 * 2


def test_both_components_are_in_a_model(models):
    assert all(set(model.networks) == set(COMPONENTS) for model in models.values())
