"""Samples that the bound of the truncation error (`stokes.plan`) is held against.

`python -m dustfall.benchmarks.truncation` draws clusters at random, leaves out degrees of all pairs
or of one alone, and prints how far the bound lies above the error, for each kind of cluster. The
numbers of the bound are the roundest ones that leave no ratio below 1; the samples that come
closest to it are two spheres alone, which hold `uniform_error`; lines of three, whose near pair is
pushed by the third along the line, which hold `missing_velocity` and `pushed`; and far clusters of
few spheres, where what is left out is one field of known direction.
"""

import numpy as np
import pandas as pd

from dustfall.benchmarks.stress import fine_forces
from dustfall.spheres import centre_distances
from dustfall.stokes.plan import error_bound
from dustfall.streams import Purpose, stream
from dustfall.units import CONTACT, STOKES_DRAG

KINDS = ("pair", "line", "triple", "quadruple")

FINE_DEGREE = 34
"""Degree of all pairs that stands for all degrees; a pair alone 0.003 d_p apart is off by 1e-9."""

GAPS = (3e-3, 100.0)
"""Range of the gaps [d_p], log-uniform."""

MOST_LEFT_OUT = 14
"""Largest degree that a pair is cut off at: what FINE_DEGREE lacks must not count beside it."""

SMALLEST_ERROR = 1e-9
"""Errors below are those of FINE_DEGREE and of the iteration."""


def sampled(number: int, seed: int = 1, progress=None) -> pd.DataFrame:
    """Bound and error of `number` random clusters of each kind, one row for each sphere.

    Columns kind, cluster, gap (smallest [d_p]), degree (largest), alone (whether one pair alone is
    cut off), bound and error, both relative to the force on an isolated sphere. Rows whose error is
    below SMALLEST_ERROR are left out.
    """
    rows = []
    for kind, name in enumerate(KINDS):
        for item in range(number):
            rng = stream(Purpose.TRUNCATION, seed, kind, item)
            centres = _cluster(name, rng)
            n, distance = len(centres), centre_distances(centres)
            flow = rng.standard_normal(3)
            degrees, alone = _cut(rng, n)
            exact = fine_forces(centres, flow, FINE_DEGREE)
            force = fine_forces(centres, flow, degrees)
            error = np.abs(force - exact).max(axis=1) / STOKES_DRAG
            bound = error_bound(centres, distance, degrees, force / STOKES_DRAG)
            rows += [
                (name, item, distance.min() - CONTACT, np.min(degrees + FINE_DEGREE * np.eye(n)),
                 alone, bound[i], error[i])
                for i in range(n) if error[i] > SMALLEST_ERROR
            ]  # fmt: skip
            if progress is not None:
                progress(kind * number + item + 1, number * len(KINDS))
    return pd.DataFrame(
        rows, columns=["kind", "cluster", "gap", "degree", "alone", "bound", "error"]
    )


def _cluster(kind: str, rng) -> np.ndarray:
    """Centres (n, 3) [d_p], each sphere next to one that is there already."""
    centres = [np.zeros(3)]
    direction = _direction(rng)
    spheres = {"pair": 2, "line": 3, "triple": 3, "quadruple": 4}[kind]
    while len(centres) < spheres:
        gap = np.exp(rng.uniform(*np.log(GAPS)))
        if kind != "line":
            direction = _direction(rng)
        candidate = centres[rng.integers(len(centres))] + (CONTACT + gap) * direction
        apart = np.linalg.norm(candidate - np.array(centres), axis=1).min()
        if apart >= CONTACT + GAPS[0]:
            centres.append(candidate)
    return np.array(centres)


def _cut(rng, n: int) -> tuple[np.ndarray, bool]:
    """Degrees (n, n) of all pairs, or fine ones but for a pair, at random."""
    degree = rng.integers(MOST_LEFT_OUT + 1)
    alone = n > 2 and rng.random() < 0.5
    degrees = np.full((n, n), FINE_DEGREE if alone else degree)
    if alone:
        i, j = rng.choice(n, 2, replace=False)
        degrees[i, j] = degrees[j, i] = degree
    np.fill_diagonal(degrees, 0)
    return degrees, alone


def _direction(rng) -> np.ndarray:
    """Isotropic unit vector."""
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


if __name__ == "__main__":
    samples = sampled(200)
    ratio = (samples["bound"] / samples["error"]).groupby([samples["kind"], samples["alone"]])
    print(ratio.describe(percentiles=[0.01, 0.1, 0.5]).to_string(float_format="%.3g"))
