"""Cross-validation of layer configurations, and the choice among them."""

import numpy as np

from dustfall.forces.learned import parse_layers
from dustfall.streams import Purpose, stream
from dustfall.training.fit import (
    SETTINGS,
    TrainingSettings,
    check_samples,
    check_weight,
    score,
    train_networks,
    training_scenes,
)
from dustfall.units import COMPONENTS


def cross_validate(
    neighbours,
    force,
    component: str,
    layers: str,
    folds: int = 10,
    settings: TrainingSettings | None = None,
    seed: int = 1,
    kind: str = "idnn",
    radial_input: str = "logarithm",
    device: str = "cpu",
    progress=None,
    weight=None,
) -> dict:
    """Train a layer configuration once a fold, each time validated on the fold left out.

    Parameters: `neighbours` (m, k, 3) in d_p, `force` (m, 3) in Re_p c_D, `component` streamwise
    or lateral, the rest as in `training.train_model`. Returns plain values for a JSON file:
    component, kind, layers, neighbours and parameters (their numbers), and `folds`, a list with
    fold, mse [(Re_p c_D)^2], r2 (None where the force is the same in the whole fold) and epochs (of
    the weights kept). As in the paper the fold that scores also picks the epoch. A fold depends on
    (seed, component, fold) alone: it has the same bits in any sweep. `progress(done, total)` counts
    epochs.

    Raises ValueError for arguments out of range.
    """
    parse_layers(layers, kind)
    settings = settings or SETTINGS[kind]
    if component not in COMPONENTS:
        raise ValueError(f"component is {component!r}; it must be one of {', '.join(COMPONENTS)}")
    if not isinstance(folds, int) or folds < 2:
        raise ValueError(f"folds is {folds!r}; it must be an integer >= 2")
    neighbours, force = check_samples(neighbours, force, 2 * folds)
    weight = check_weight(weight, len(force))
    scenes, _ = training_scenes(kind, neighbours, radial_input)
    dealt = stream(Purpose.FOLDS, seed).permutation(len(neighbours)) % folds
    splits = [
        (np.flatnonzero(dealt != fold), np.flatnonzero(dealt == fold)) for fold in range(folds)
    ]
    numbers = [fold + 1 for fold in range(folds)]

    def report(epoch):
        if progress:
            progress(epoch, settings.epochs)

    trained = train_networks(
        kind,
        scenes,
        force,
        component,
        layers,
        splits,
        settings,
        seed,
        numbers,
        report,
        device,
        weight,
    )
    if progress:
        progress(settings.epochs, settings.epochs)
    results = [
        {
            "fold": fold,
            **score(network, scenes, force, component, validation, weight),
            "epochs": history.best_epoch,
        }
        for fold, ((network, history), (_, validation)) in enumerate(
            zip(trained, splits, strict=True)
        )
    ]
    return {
        "component": component,
        "kind": kind,
        "layers": layers,
        "neighbours": neighbours.shape[1],
        "parameters": trained[0][0].parameters,
        "folds": results,
    }


CHOICES = ("one_standard_error", "smallest")
"""How a configuration of layers is chosen among those that are compared."""


def choose_winner(results: list[dict], choice: str = "one_standard_error") -> dict:
    """Choose one layer configuration for both components from results of `cross_validate`.

    Each component's errors are divided by that of its best configuration (mean over folds) and
    averaged over the two components, fold by fold: the error of a configuration. Among those whose
    mean error is within one standard error (over folds) of the smallest, the one with the fewest
    parameters wins (the one standard error rule); with `choice` "smallest", as in the paper, the
    smallest mean error does.

    Returns the winner's layers, the smallest error's layers ("best"), the limit, and per
    configuration a row with layers, parameters (both components), error and standard_error.
    Raises ValueError when a configuration lacks a component or the numbers of folds differ.
    """
    if choice not in CHOICES:
        raise ValueError(f"choice is {choice!r}; it must be one of {', '.join(CHOICES)}")
    if not results:
        raise ValueError("there are no cross-validation results to choose from")
    errors: dict[str, dict[str, np.ndarray]] = {component: {} for component in COMPONENTS}
    parameters: dict[str, int] = {}
    for result in results:
        layers = result["layers"]
        errors[result["component"]][layers] = np.array([fold["mse"] for fold in result["folds"]])
        parameters[layers] = parameters.get(layers, 0) + result["parameters"]
    for component, table in errors.items():
        missing = sorted(set(parameters) - set(table))
        if missing:
            raise ValueError(f"there is no {component} result for layers {', '.join(missing)}")
        if len({len(error) for error in table.values()}) != 1:
            raise ValueError(f"{component} results have different numbers of folds")
    if len({len(table[layers]) for table in errors.values() for layers in table}) != 1:
        raise ValueError("streamwise and lateral results have different numbers of folds")
    smallest = {c: min(error.mean() for error in table.values()) for c, table in errors.items()}
    rows: list[dict] = []
    for layers in parameters:
        error = np.mean([table[layers] / smallest[c] for c, table in errors.items()], axis=0)
        rows.append(
            {
                "layers": layers,
                "parameters": parameters[layers],
                "error": float(error.mean()),
                "standard_error": float(error.std(ddof=1) / np.sqrt(len(error))),
            }
        )
    best = min(rows, key=lambda row: row["error"])
    limit = best["error"] + (best["standard_error"] if choice == CHOICES[0] else 0.0)
    within = [row for row in rows if row["error"] <= limit]
    winner = min(within, key=lambda row: (row["parameters"], row["error"]))
    return {
        "layers": winner["layers"],
        "best": best["layers"],
        "limit": limit,
        "configurations": rows,
    }
