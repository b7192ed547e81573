"""Rank correlation between neighbour coordinates and force, and prediction against target."""

import numpy as np
import pandas as pd
from scipy import stats

from dustfall.analysis.distributions import COMPONENTS
from dustfall.forces.frames import check_neighbours, spherical_coordinates

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
    rho = _rank_correlation(values.reshape(samples, -1), force).reshape(-1, 3, 3)
    if not np.isfinite(rho).all():
        raise ValueError("a coordinate or force component is the same in all samples: no rank")
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
        for component, column in COMPONENTS.items()
        for i, name in enumerate(COORDINATES[coordinates])
        for k in range(len(rho))
    ]
    return pd.DataFrame(rows)


def _rank_correlation(a, b):
    """Spearman's coefficients (p, q) between the columns of a (m, p) and b (m, q)."""
    a, b = (stats.rankdata(x, axis=0) - (len(x) + 1) / 2 for x in (a, b))
    with np.errstate(invalid="ignore"):
        return (a.T @ b) / np.sqrt((a**2).sum(axis=0)[:, None] * (b**2).sum(axis=0))


def coefficient_of_determination(target, predicted) -> float:
    """R^2 = 1 - sum of squared errors / sum of squared deviations of the target from its mean.

    Raises ValueError for different shapes or a target without variance.
    """
    target, predicted = np.asarray(target, dtype=float), np.asarray(predicted, dtype=float)
    if target.shape != predicted.shape:
        raise ValueError(f"target has shape {target.shape}, prediction {predicted.shape}")
    deviation = np.sum((target - target.mean()) ** 2) if target.size else 0.0
    if deviation == 0:
        raise ValueError("the target has no variance: R^2 is not defined")
    return float(1 - np.sum((target - predicted) ** 2) / deviation)


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
        for component, columns in {"streamwise": [1], "lateral": [0, 2]}.items():
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
