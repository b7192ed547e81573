"""Run time of the solver against the error of the force, on random scenes."""

import time
from collections.abc import Sequence

import numpy as np
import pandas as pd

from dustfall import STOKES_DRAG
from dustfall.stokes.many_body import one_body_response, solve
from dustfall.stokes.one_body import OneBody
from dustfall.stokes.records import plan_shard

REFERENCE_TOLERANCE = 1e-8


def time_against_error(
    neighbours,
    volume_fraction,
    body: OneBody,
    tolerances: Sequence[float],
    repeats: int = 3,
    progress=None,
) -> pd.DataFrame:
    """Solve scenes (m, 5, 3) at several tolerances, against themselves at 1e-8.

    Errors are those of the force on the reference sphere over 24. Returns one row for each decade
    of phi and tolerance: scenes, milliseconds (a scene, planning included, median of `repeats`),
    iterations (mean), error_median, error_95, error_max, covered (share of scenes whose estimate
    is at least the error), estimate_over_error (median).
    """
    decade = np.floor(np.log10(volume_fraction)).astype(int)
    response = one_body_response(body, REFERENCE_TOLERANCE)
    plans = plan_shard(neighbours, REFERENCE_TOLERANCE)
    reference = [solve(plan, response, tolerance=REFERENCE_TOLERANCE).force[0] for plan in plans]
    groups = [np.flatnonzero(decade == d) for d in np.unique(decade)]
    rows = []
    for tolerance in tolerances:
        response = one_body_response(body, tolerance)
        for own in groups:
            seconds = []
            for _ in range(repeats):
                start = time.perf_counter()
                plans = plan_shard(neighbours[own], tolerance)
                solutions = [solve(plan, response, tolerance=tolerance) for plan in plans]
                seconds.append(time.perf_counter() - start)
            exact = np.array([reference[k] for k in own])
            found = np.array([s.force[0] for s in solutions])
            error = np.abs(found - exact).max(axis=1) / STOKES_DRAG
            estimate = np.array([s.error_estimate[0] for s in solutions])
            rows.append(
                {
                    "phi_low": 10.0 ** decade[own[0]],
                    "tolerance": tolerance,
                    "scenes": len(own),
                    "milliseconds": 1e3 * np.median(seconds) / len(own),
                    "iterations": np.mean([s.iterations for s in solutions]),
                    "error_median": np.median(error),
                    "error_95": np.quantile(error, 0.95),
                    "error_max": error.max(),
                    "covered": np.mean(estimate >= error),
                    "estimate_over_error": np.median(estimate / np.maximum(error, 1e-16)),
                }
            )
            if progress is not None:
                progress(len(rows), len(tolerances) * len(groups))
    return pd.DataFrame(rows)
