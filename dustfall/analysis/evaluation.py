"""How well force models predict: scores, errors near contact, broken symmetries."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from dustfall.analysis.correlations import coefficient_of_determination
from dustfall.analysis.distributions import decades
from dustfall.columns import Column
from dustfall.dataset import Dataset
from dustfall.forces.learned import LearnedModel
from dustfall.scenes import SCENE_COLUMNS
from dustfall.units import COMPONENTS

ANGLE = 1.0
"""Turn about the flow axis [rad] that `symmetry_violations` tries: no part of a full turn."""


def prediction_columns(models: Iterable[str]) -> dict[str, Column]:
    """Columns of the file of predictions on the test scenes: the truth, and each model's force."""
    return {
        "target": Column("Re_p c_D", "force on the reference sphere"),
        "gap": Column("d_p", "surface distance of the nearest neighbour"),
        "volume_fraction": SCENE_COLUMNS["volume_fraction"],
        "radial_law": Column("", "law that the distances of the neighbours were drawn by"),
        **{model: Column("Re_p c_D", f"force predicted by {model}") for model in models},
    }


def scores(predictions: Mapping[str, np.ndarray], test: Dataset) -> pd.DataFrame:
    """Tabulate R^2, RMS and largest error of each model, by radial law and decade of phi.

    predictions: name -> force (m, 3) [Re_p c_D] on the scenes of `test`. Every model is given the
    neighbours in the order of `test`, which `dataset.split` makes random: none is told more.

    Returns the columns model, component, radial_law, phi_low, phi_high, samples, r2 (of both
    components of "lateral" together; NaN where the force does not vary), rms_error and
    largest_error [Re_p c_D]. The first rows of each law are those of all its decades.
    """
    rows = []
    for law in dict.fromkeys(test.radial_law):
        own = test.radial_law == law
        phi = test.volume_fraction[own]
        groups = [(phi.min(), phi.max(), np.ones(len(phi), bool)), *decades(phi)]
        for low, high, inside in groups:
            chosen = np.flatnonzero(own)[inside]
            for model, predicted in predictions.items():
                for component, columns in COMPONENTS.items():
                    target = test.force[chosen][:, columns]
                    error = predicted[chosen][:, columns] - target
                    rows.append(
                        {
                            "model": model,
                            "component": component,
                            "radial_law": law,
                            "phi_low": low,
                            "phi_high": high,
                            "samples": len(chosen),
                            "r2": coefficient_of_determination(target, target + error)
                            if np.ptp(target) > 0
                            else np.nan,
                            "rms_error": np.sqrt((error**2).mean()),
                            "largest_error": np.abs(error).max(),
                        }
                    )
    return pd.DataFrame(rows)


def training_history(model: LearnedModel, test: Dataset) -> pd.DataFrame:
    """Tabulate the validation errors of a model just trained, and what it reached.

    Returns the columns component, training_scenes, epoch, validation_error [(Re_p c_D)^2] and r2,
    that of the weights kept on all scenes of `test`, the same in all rows of a component.
    """
    # Of one law, so that the first rows are those of all scenes.
    test = replace(test, radial_law=np.full(len(test), "all"))
    whole = scores({model.name: model.predict(test.neighbours)}, test)
    reached = whole.drop_duplicates("component").set_index("component")["r2"]
    return pd.concat(
        pd.DataFrame(
            {
                "component": component,
                "training_scenes": model.header["training"]["samples"],
                "epoch": history.epochs,
                "validation_error": history.validation_error,
                "r2": reached[component],
            }
        )
        for component, history in model.history.items()
    )


def error_by_gap(
    predictions: Mapping[str, np.ndarray], target, gap, bins: int = 24
) -> pd.DataFrame:
    """Tabulate the error of each model against the gap to the nearest neighbour.

    predictions: name -> force (m, 3); target: (m, 3) [Re_p c_D]; gap: (m,) [d_p]. The scenes,
    sorted by gap, are cut into `bins` of equal number. Returns the columns model, gap (median of
    the bin) [d_p], samples, rms_error (of the force vector), largest_error (of its length)
    [Re_p c_D].
    """
    parts = [part for part in np.array_split(np.argsort(gap, kind="stable"), bins) if len(part)]
    rows = []
    for model, predicted in predictions.items():
        error = np.linalg.norm(predicted - target, axis=1)
        rows += [
            {
                "model": model,
                "gap": np.median(gap[part]),
                "samples": len(part),
                "rms_error": np.sqrt((error[part] ** 2).mean()),
                "largest_error": error[part].max(),
            }
            for part in parts
        ]
    return pd.DataFrame(rows)


def symmetry_violations(models, neighbours: np.ndarray) -> pd.DataFrame:
    """Measure how far models break the symmetries of Stokes flow.

    models: objects with `name` and `predict`; neighbours (m, 5, 3) [d_p].

    Turned about the flow axis or mirrored through it, a scene has its force turned or mirrored;
    inverted through the reference sphere it keeps its force. Returns the columns model, symmetry
    ("rotation", "mirror", "inversion"), rms and largest: of the length of the difference between
    the force of the image and the image of the force [Re_p c_D].
    """
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    mirror = np.diag([-1.0, 1.0, 1.0])
    images = {
        "rotation": (rotation, rotation),
        "mirror": (mirror, mirror),
        "inversion": (-np.eye(3), np.eye(3)),
    }
    rows = []
    for model in models:
        force = model.predict(neighbours)
        for symmetry, (of_scene, of_force) in images.items():
            image = model.predict(neighbours @ of_scene.T)
            difference = np.linalg.norm(image - force @ of_force.T, axis=1)
            rows.append(
                {
                    "model": model.name,
                    "symmetry": symmetry,
                    "rms": np.sqrt((difference**2).mean()),
                    "largest": difference.max(),
                }
            )
    return pd.DataFrame(rows)
