"""Rank correlation between neighbour coordinates and force, and prediction against target."""

import numpy as np
import pandas as pd
import scipy

from dustfall.forces.frames import check_neighbours, spherical_coordinates
from dustfall.units import AXES, COMPONENTS

COORDINATES = {
    "spherical": ("radial", "azimuthal", "polar"),
    "cartesian": ("spanwise", "streamwise", "vertical"),
}


def spearman_by_neighbours(neighbours, force, coordinates="spherical") -> pd.DataFrame:
    """Correlate each coordinate of the neighbours with each force component, by rank.

    Parameters: `neighbours` (m, 5, 3) [d_p], nearest first, `force` (m, 3), `coordinates`
    "spherical" (polar axis z, azimuth in the spanwise-streamwise plane) or "cartesian".

    Returns the columns coordinates, coordinate, component, neighbours, rho, rho_of_neighbour,
    noise, samples. `rho_of_neighbour` is Spearman's coefficient of the k-th neighbour alone;
    `rho` is the mean of its magnitude over the first k neighbours (paper, figure of the Spearman
    correlation); `noise` is the mean magnitude that independent data of this size would show,
    sqrt(2/(pi (m - 1))).

    Raises ValueError for bad arrays, fewer than three samples, or a force or coordinate that
    never changes.
    """
    neighbours = check_neighbours(neighbours)
    force = np.asarray(force, dtype=float)
    samples = len(neighbours)
    if force.shape != (samples, 3) or not np.isfinite(force).all():
        raise ValueError(f"forces have shape {force.shape}; finite values ({samples}, 3) needed")
    if samples < 3:
        raise ValueError(f"a rank correlation of {samples} samples says nothing; 3 are needed")
    if coordinates not in COORDINATES:
        raise ValueError(f"coordinates are {coordinates!r}; allowed: {', '.join(COORDINATES)}")
    values = spherical_coordinates(neighbours) if coordinates == "spherical" else neighbours
    values = values.reshape(samples, -1)
    if (np.ptp(values, axis=0) == 0).any() or (np.ptp(force, axis=0) == 0).any():
        raise ValueError("a coordinate or force component is the same in all samples: no rank")
    rho = scipy.stats.spearmanr(values, force).statistic[: values.shape[1], values.shape[1] :]
    rho = rho.reshape(-1, 3, 3)
    mean = np.abs(rho).cumsum(axis=0) / np.arange(1, len(rho) + 1)[:, None, None]
    rows = [
        {
            "coordinates": coordinates,
            "coordinate": name,
            "component": component,
            "neighbours": k + 1,
            "rho": mean[k, i, column],
            "rho_of_neighbour": rho[k, i, column],
            "noise": np.sqrt(2 / (np.pi * (samples - 1))),
            "samples": samples,
        }
        for component, column in AXES.items()
        for i, name in enumerate(COORDINATES[coordinates])
        for k in range(len(rho))
    ]
    return pd.DataFrame(rows)


def coefficient_of_determination(target, predicted) -> float:
    """R^2 = 1 - mean squared error / variance of the target, over all components together.

    The variance is that about one mean of all components. The square of a correlation, which SciPy
    gives, would forgive a prediction its wrong level and scale.

    Raises ValueError for different shapes or a target without variance.
    """
    target, predicted = np.asarray(target, dtype=float), np.asarray(predicted, dtype=float)
    if target.shape != predicted.shape:
        raise ValueError(f"target has shape {target.shape}, prediction {predicted.shape}")
    if target.size == 0 or np.ptp(target) == 0:
        raise ValueError("the target has no variance: R^2 is not defined")
    return float(1 - np.mean((target - predicted) ** 2) / target.var())


def predictions_against_target(target, predictions, number=1000) -> pd.DataFrame:
    """Tabulate predicted against target forces of several models, with R^2 over all samples.

    Parameters: `target` (m, 3) and `predictions`, a mapping of model name to (m, 3), in Re_p c_D;
    `number` is the most samples that a model and component keep, evenly spaced in the given order.
    "lateral" is spanwise and vertical together, as in the paper.

    Returns the columns model, component, target, predicted, r2, samples; r2 and samples tell of
    all samples, not only of those kept.

    Raises ValueError for no model, mismatched shapes or a target without variance.
    """
    target = np.asarray(target, dtype=float)
    if target.ndim != 2 or target.shape[1] != 3:
        raise ValueError(f"target forces have shape {target.shape}; they must be (m, 3)")
    if not predictions:
        raise ValueError("there are no predictions: at least one model is needed")
    tables = []
    for model, predicted in predictions.items():
        predicted = np.asarray(predicted, dtype=float)
        if predicted.shape != target.shape or not np.isfinite(predicted).all():
            raise ValueError(
                f"predictions of {model} have shape {predicted.shape}; finite {target.shape} needed"
            )
        for component, columns in COMPONENTS.items():
            x, y = target[:, columns].ravel(), predicted[:, columns].ravel()
            kept = np.arange(len(x))
            if len(x) > number:
                kept = np.linspace(0, len(x) - 1, number).round().astype(int)
            tables.append(
                pd.DataFrame(
                    {
                        "model": model,
                        "component": component,
                        "target": x[kept],
                        "predicted": y[kept],
                        "r2": coefficient_of_determination(x, y),
                        "samples": len(x),
                    }
                )
            )
    return pd.concat(tables, ignore_index=True)
