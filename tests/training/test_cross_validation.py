import numpy as np
import pytest

from dustfall.training import TrainingSettings, choose_winner, cross_validate
from dustfall.training.fit import train_networks, training_scenes

SETTINGS = TrainingSettings(batch_size=128, epochs=4, validate_every=2)


@pytest.fixture(scope="module")
def few(samples):
    return tuple(array[:600] for array in samples)


def test_a_trial_has_the_same_bits_alone_and_in_a_sweep(few):
    alone = cross_validate(*few, "lateral", "8/6", folds=3, settings=SETTINGS)
    cross_validate(*few, "streamwise", "8/6", folds=3, settings=SETTINGS)
    cross_validate(*few, "lateral", "12-12/6", folds=3, settings=SETTINGS)
    assert cross_validate(*few, "lateral", "8/6", folds=3, settings=SETTINGS) == alone


def test_every_fold_is_scored_with_the_number_of_parameters(few):
    result = cross_validate(*few, "streamwise", "8/6", folds=4, settings=SETTINGS)
    assert [fold["fold"] for fold in result["folds"]] == [0, 1, 2, 3]
    # 6 inputs to 8 hidden with bias, 8 to 1 without; 3 to 6 with bias, 6 to 1 without.
    assert result["parameters"] == (6 * 8 + 8 + 8) + (3 * 6 + 6 + 6)
    assert all(fold["mse"] > 0 and fold["r2"] < 1 for fold in result["folds"])
    assert all(fold["epochs"] in (2, 4) for fold in result["folds"])
    assert len({fold["mse"] for fold in result["folds"]}) == 4


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"component": "vertical"}, "component"),
        ({"layers": "8"}, "layers"),
        ({"folds": 1}, "folds"),
        ({"folds": 400}, "samples"),
    ],
)
def test_arguments_out_of_range_are_named(few, wrong, name):
    arguments = {"component": "lateral", "layers": "8/6", "folds": 3, "settings": SETTINGS}
    with pytest.raises(ValueError, match=name):
        cross_validate(*few, **{**arguments, **wrong})


def result(component, layers, parameters, errors):
    folds = [{"fold": k, "mse": mse, "r2": 0.0, "epochs": 1} for k, mse in enumerate(errors)]
    return {"component": component, "layers": layers, "parameters": parameters, "folds": folds}


def test_winner_is_the_smallest_within_one_standard_error():
    table = []
    # Standard error of the best over its four folds: 0.1 of its mean.
    best = 1 + 0.1 * np.sqrt(3) * np.array([1, -1, 1, -1])
    for component, unit in (("streamwise", 1e-3), ("lateral", 7.0)):
        table.append(result(component, "90/90", 900, unit * best))
        table.append(result(component, "40/40", 400, unit * (best + 0.08)))
        table.append(result(component, "10/10", 100, unit * (best + 0.12)))
    choice = choose_winner(table)
    assert choice["best"] == "90/90"
    assert choice["layers"] == "40/40"
    assert choice["limit"] == pytest.approx(1.1)
    rows = {row["layers"]: row for row in choice["configurations"]}
    assert choose_winner(table, "smallest")["layers"] == "90/90"
    assert rows["90/90"]["parameters"] == 1800
    assert rows["90/90"]["standard_error"] == pytest.approx(0.1)


def test_winner_needs_both_components_and_equal_folds():
    table = [result("streamwise", "9/9", 9, [1, 2]), result("lateral", "9/9", 9, [1, 2])]
    assert choose_winner(table)["layers"] == "9/9"
    with pytest.raises(ValueError, match="no lateral result for layers 9/9"):
        choose_winner(table[:1])
    with pytest.raises(ValueError, match="folds"):
        choose_winner([table[0], result("lateral", "9/9", 9, [1, 2, 3])])
    with pytest.raises(ValueError, match="no cross-validation results"):
        choose_winner([])
    with pytest.raises(ValueError, match="choice is 'best'"):
        choose_winner(table, "best")


def test_a_fold_learns_the_same_alone_and_beside_others(few):
    neighbours, force = few
    scenes, _ = training_scenes("idnn", neighbours, "logarithm")
    splits = [(np.arange(100 * k, 600), np.arange(100 * k)) for k in (1, 2)]

    def errors(chosen):
        trained = train_networks(
            "idnn", scenes, force, "lateral", "8/6", [splits[k] for k in chosen], SETTINGS,
            1, [k + 1 for k in chosen],
        )  # fmt: skip
        return [history.validation_error for _, history in trained]

    # The second trains on the fewest samples, which sets the steps of both.
    assert errors([1])[0] == pytest.approx(errors([0, 1])[1], rel=1e-5)
    assert errors([0, 1]) == errors([0, 1])
    assert errors([0, 1])[0] != errors([0, 1])[1]
