import json

import numpy as np
import pytest
import torch
from safetensors import safe_open

from dustfall.forces.formulas.reflections import MODEL as REFLECTED
from dustfall.streams import Purpose, stream
from dustfall.training import PAPER_SETTINGS, TrainingSettings, train_model
from tests.forces.scenes import LAYERS, corrected_forces, random_neighbours


def r2(predicted, target):
    return 1 - ((predicted - target) ** 2).sum() / ((target - target.mean(axis=0)) ** 2).sum()


def test_idnn_learns_the_streamwise_force_of_unseen_scenes(models):
    neighbours = random_neighbours(1000, seed=9)
    force = corrected_forces(neighbours)
    assert r2(models["idnn"].predict(neighbours)[:, 1], force[:, 1]) > 0.9


def test_anchored_model_exceeds_the_reflections_on_unseen_scenes(models):
    neighbours = random_neighbours(1000, seed=9)
    force = corrected_forces(neighbours)
    error = (models["anchored"].predict(neighbours) - force).std(axis=0)
    baseline = (REFLECTED.predict(neighbours) - force).std(axis=0)
    assert (error < 0.6 * baseline).all()


def test_reported_scores_are_those_of_the_kept_weights(models, samples):
    neighbours, force = samples
    model = models["idnn"]
    rows = np.sort(stream(Purpose.VALIDATION, 1).permutation(len(neighbours))[:300])
    scores = model.header["training"]["validation"]
    predicted = model.predict(neighbours[rows])
    assert scores["streamwise"]["r2"] == pytest.approx(r2(predicted[:, 1], force[rows, 1]))
    lateral = r2(predicted[:, [0, 2]], force[rows][:, [0, 2]])
    assert scores["lateral"]["r2"] == pytest.approx(lateral)
    for component, history in model.history.items():
        assert scores[component]["mse"] == pytest.approx(min(history.validation_error), rel=1e-3)


@pytest.mark.parametrize("threads", [1, 2])
def test_the_same_seed_gives_the_same_bits(models, samples, tmp_path, threads):
    settings = TrainingSettings(batch_size=128, epochs=25, validate_every=5)
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        again = train_model("anchored", *samples, LAYERS["anchored"], settings)
        assert torch.get_num_threads() == threads
    finally:
        torch.set_num_threads(before)
    models["anchored"].save(tmp_path / "first.safetensors")
    again.save(tmp_path / "again.safetensors")
    first, second = (tmp_path / f"{name}.safetensors" for name in ("first", "again"))
    assert first.read_bytes() == second.read_bytes()


def test_a_seed_of_numpy_gives_the_same_file(samples, tmp_path):
    neighbours, force = (part[:100] for part in samples)
    for name, seed in (("one", 3), ("other", np.int64(3))):
        model = train_model("dense", neighbours, force, "4", TrainingSettings(epochs=1), seed)
        model.save(tmp_path / f"{name}.safetensors")
    one, other = (tmp_path / f"{name}.safetensors" for name in ("one", "other"))
    assert one.read_bytes() == other.read_bytes()


def test_another_seed_gives_other_weights_and_another_split(samples):
    settings = TrainingSettings(batch_size=256, epochs=1)
    one, two = (train_model("dense", *samples, "8", settings, seed=seed) for seed in (1, 2))
    neighbours = random_neighbours(5)
    assert (one.predict(neighbours) != two.predict(neighbours)).any()
    assert one.header["training"]["validation"] != two.header["training"]["validation"]


def test_training_stops_when_patience_ends_and_keeps_the_best_epoch(samples):
    neighbours, force = (array[:200] for array in samples)
    settings = TrainingSettings(
        batch_size=0, epochs=400, learning_rate=0.05, schedule="constant", validate_every=5,
        patience=20,
    )  # fmt: skip
    model = train_model("dense", neighbours, force, "30-30", settings)
    history = model.history["lateral"]
    assert history.epochs[-1] < 400
    assert history.epochs[-1] - history.best_epoch >= 20
    assert min(history.validation_error) == pytest.approx(
        model.header["training"]["validation"]["lateral"]["mse"], rel=1e-3
    )


def test_paper_settings_are_full_batch_with_patience():
    assert PAPER_SETTINGS.batch_size == 0
    assert PAPER_SETTINGS.schedule == "constant"
    assert (PAPER_SETTINGS.validate_every, PAPER_SETTINGS.patience) == (100, 10_000)


def test_progress_counts_to_its_total(samples):
    seen = []
    train_model(
        "dense",
        *samples,
        "4",
        TrainingSettings(epochs=3, batch_size=0),
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen[-1] == (6, 6)
    assert seen == sorted(seen)


def test_header_tells_how_the_model_was_made(models, samples):
    header = models["anchored"].header
    assert header["units"] == {"length": "d_p", "force": "Re_p c_D"}
    assert header["training"]["samples"] == len(samples[0])
    assert len(header["training"]["data_sha256"]) == 64


@pytest.mark.parametrize(
    "wrong",
    [
        {"batch_size": -1},
        {"batch_size": 1.5},
        {"epochs": 0},
        {"learning_rate": 0.0},
        {"weight_decay": -1e-3},
        {"validate_every": 0},
        {"patience": 0},
        {"schedule": "linear"},
    ],
)
def test_settings_out_of_range_are_named(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        TrainingSettings(**wrong)


def test_samples_that_do_not_fit_are_refused(samples):
    neighbours, force = samples
    with pytest.raises(ValueError, match="kind"):
        train_model("pairs", neighbours, force, "8")
    with pytest.raises(ValueError, match="force has shape"):
        train_model("dense", neighbours, force[:10], "8")
    with pytest.raises(ValueError, match="not finite"):
        train_model("dense", neighbours, force * np.nan, "8")
    with pytest.raises(ValueError, match="needs 10"):
        train_model("dense", neighbours[:5], force[:5], "8")
    with pytest.raises(ValueError, match="radial_input"):
        train_model("idnn", neighbours, force, "8/8", radial_input="square")


@pytest.mark.skipif(torch.cuda.is_available(), reason="needs a machine without a GPU")
def test_a_gpu_that_is_not_there_is_named(samples):
    with pytest.raises(ValueError, match="no GPU"):
        train_model("dense", *samples, "8", TrainingSettings(epochs=1), device="cuda")


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_a_gpu_trains_as_well_as_the_processor(samples):
    settings = TrainingSettings(batch_size=128, epochs=10)
    errors = [
        train_model("idnn", *samples, "8/8", settings, device=device).header["training"]
        for device in ("cpu", "cuda")
    ]
    one, other = (error["validation"]["streamwise"]["mse"] for error in errors)
    assert other == pytest.approx(one, rel=0.2)


def test_diverging_training_says_so(samples):
    settings = TrainingSettings(epochs=20, learning_rate=1e30, batch_size=64)
    with pytest.raises(FloatingPointError, match="diverged"):
        train_model("dense", *samples, "8-8", settings)


def test_scenes_of_little_weight_teach_nothing(samples):
    neighbours, force = (part[:600] for part in samples)
    wrong = np.arange(600) % 3 == 0
    spoilt = np.where(wrong[:, None], -force, force)
    settings = TrainingSettings(batch_size=128, epochs=20, validate_every=5)
    heeded, ignored = (
        train_model("pairwise", neighbours, spoilt, "16-16", settings, weight=weight)
        for weight in (None, np.where(wrong, 1e-6, 1.0))
    )
    heeded, ignored = (
        r2(model.predict(neighbours)[~wrong, 1], force[~wrong, 1]) for model in (heeded, ignored)
    )
    assert ignored > 0.6 > 0.0 > heeded


def test_the_unit_of_the_weights_does_not_matter(samples):
    neighbours, force = (part[:100] for part in samples)
    settings = TrainingSettings(batch_size=32, epochs=2)
    weight = np.random.default_rng(3).uniform(0.5, 2.0, 100)
    one, other = (
        train_model("dense", neighbours, force, "8", settings, weight=unit * weight).predict(
            neighbours
        )
        for unit in (1.0, 1024.0)
    )
    np.testing.assert_array_equal(one, other)


def test_an_input_that_is_constant_up_to_rounding_is_not_blown_up(samples):
    neighbours, force = (part[:500] for part in samples)
    planar = neighbours * [1.0, 1.0, 0.0]
    model = train_model("pairwise", planar, force, "8", TrainingSettings(epochs=1))
    for network in model.networks.values():
        assert network.scale[2] == 1.0
        assert (network.scale[:2] > 0.1).all()
    other = train_model("pairwise", neighbours, force, "8", TrainingSettings(epochs=1))
    assert (other.networks["lateral"].scale != 1.0).all()


@pytest.mark.parametrize("number", [10, 14, 15])
def test_of_few_samples_two_are_kept_for_validation(samples, number):
    neighbours, force = (part[:number] for part in samples)
    model = train_model("dense", neighbours, force, "4", TrainingSettings(epochs=1))
    rows = stream(Purpose.VALIDATION, 1).permutation(number)[:2]
    score = model.header["training"]["validation"]["streamwise"]
    expected = r2(model.predict(neighbours[rows])[:, 1], force[rows, 1])
    assert score["r2"] == pytest.approx(expected)


@pytest.mark.parametrize("weight", [None, np.arange(1.0, 31.0)])
def test_a_force_that_does_not_vary_has_no_r2_and_a_header_of_json(samples, tmp_path, weight):
    force = np.tile([0.1, 24.3, 0.0], (30, 1))
    settings = TrainingSettings(epochs=1)
    model = train_model("dense", samples[0][:30], force, "4", settings, weight=weight)
    model.save(tmp_path / "model.safetensors")
    with safe_open(tmp_path / "model.safetensors", framework="numpy") as file:
        header = json.loads(file.metadata()["header"], parse_constant=pytest.fail)
    assert [score["r2"] for score in header["training"]["validation"].values()] == [None, None]


@pytest.mark.parametrize("weight", [np.zeros(100), np.ones(99), np.full(100, np.nan)])
def test_weights_that_weigh_nothing_are_refused(samples, weight):
    neighbours, force = (part[:100] for part in samples)
    with pytest.raises(ValueError, match="weight must be 100 finite values above 0"):
        train_model("dense", neighbours, force, "8", weight=weight)
