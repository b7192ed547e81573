"""Settling velocity of the cloud: time series, steady state with interval, tracked particles."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import xarray as xr
from scipy import stats

from dustfall.analysis.references import (
    BATCHELOR_COEFFICIENT,
    DEL_BELLO,
    PAPER_STEADY_STATE,
    RANDOM_START,
)

CASE = ("model", "n", "volume_fraction", "galileo")
"""Attributes that tell one case from another; runs that share them differ by their seed."""

FEWEST_BATCHES = 5
MOST_BATCHES = 30
BATCH_LENGTH = 4
"""Length of a batch in correlation lengths: with it and at least five batches, 95 % intervals of
autoregressive series of 10 to 1,000 correlation times hold the true mean in 92 to 96 % of cases."""

FEWEST_SEEDS = 3
"""From this many independent runs on, the spread between them gives the interval."""

PARTICLE_MEANS = ("settling_velocity_mean", "inverse_beta_mean")
"""Series that are means over particles of something that spreads like the settling velocity."""

SHARED_NEIGHBOURS = 1.3
"""Particles share neighbours, so the mean over n random ones spreads more than by 1/sqrt(n): 1.02
(phi = 1e-3) to 1.33 times (1e-8) as much, over 150 to 400 random starts of 200 and 1,000."""


@dataclass(frozen=True)
class Mean:
    """A mean with its standard error, the degrees of freedom behind it, and its interval."""

    value: float
    standard_error: float
    degrees_of_freedom: float
    correlation_length: float
    confidence: float = 0.95

    @property
    def half_width(self) -> float:
        """Half the width of the confidence interval (Student's t)."""
        return float(
            stats.t.ppf(0.5 + self.confidence / 2, self.degrees_of_freedom) * self.standard_error
        )


def correlation_length(values) -> float:
    """Samples of an evenly sampled series (m,) that count for one independent sample.

    1 + 2 times the sum of the autocorrelation, summed up to five times itself (Sokal 1997); one
    for uncorrelated or constant series.
    """
    x = np.asarray(values, dtype=float)
    x = x - x.mean()
    if x.size < 2 or not x.any():
        return 1.0
    spectrum = np.fft.rfft(x, 2 * x.size)
    autocorrelation = np.fft.irfft(spectrum * spectrum.conj())[: x.size]
    length = 2 * np.cumsum(autocorrelation / autocorrelation[0]) - 1
    closed = np.flatnonzero(np.arange(x.size) >= 5 * length)
    return float(max(1.0, length[closed[0]] if closed.size else length.max()))


def mean_with_interval(values, confidence=0.95) -> Mean:
    """Mean of a correlated, evenly sampled series (m,) with an honest interval, by batch means.

    The series is cut into 5 to 30 batches of at least four correlation lengths where it is long
    enough; the spread of the batch means gives the standard error, and Student's t with one degree
    of freedom less than batches the interval.

    Raises ValueError for fewer than ten values or values that are not finite.
    """
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or x.size < 2 * FEWEST_BATCHES:
        raise ValueError(
            f"a series of shape {x.shape} has no interval; at least {2 * FEWEST_BATCHES} values"
        )
    if not np.isfinite(x).all():
        raise ValueError(f"value {int(np.flatnonzero(~np.isfinite(x))[0])} is not finite")
    length = correlation_length(x)
    batches = int(np.clip(x.size / (BATCH_LENGTH * length), FEWEST_BATCHES, MOST_BATCHES))
    size = x.size // batches
    means = x[x.size - batches * size :].reshape(batches, size).mean(axis=1)
    error = means.std(ddof=1) / np.sqrt(batches)
    return Mean(float(x.mean()), float(error), batches - 1, length, confidence)


def mean_of_runs(means: list[Mean]) -> Mean:
    """Combine the means of independent runs of one case.

    From three runs on, the spread between runs gives the standard error; below that, the errors
    within the runs do.
    """
    k = len(means)
    values = np.array([m.value for m in means])
    if k >= FEWEST_SEEDS:
        error, freedom = values.std(ddof=1) / np.sqrt(k), k - 1
    else:
        error = np.sqrt(sum(m.standard_error**2 for m in means)) / k
        freedom = sum(m.degrees_of_freedom for m in means)
    length = float(np.mean([m.correlation_length for m in means]))
    return Mean(float(values.mean()), float(error), freedom, length, means[0].confidence)


def case_of(dataset: xr.Dataset) -> dict:
    """Return the attributes that name the case of a run, or raise ValueError naming one missing."""
    missing = [name for name in CASE if name not in dataset.attrs]
    if missing:
        raise ValueError(f"the dataset lacks the attribute {missing[0]!r}; it needs {CASE}")
    return {
        "model": str(dataset.attrs["model"]),
        "n": int(dataset.attrs["n"]),
        "volume_fraction": float(dataset.attrs["volume_fraction"]),
        "galileo": float(dataset.attrs["galileo"]),
    }


def from_time(dataset: xr.Dataset, start: float, dimension: str) -> xr.Dataset:
    """Return the part of a run from `start` [tau] on; ValueError when nothing is left."""
    time = np.asarray(dataset["time"], dtype=float)
    part = dataset.isel({dimension: np.flatnonzero(time >= start)})
    if part.sizes[dimension] == 0:
        raise ValueError(f"statistics start at {start} tau, but the run ends at {time.max()} tau")
    return part


def even_interval(time) -> float:
    """Interval of evenly spaced times (m,); ValueError where they are uneven or fewer than four."""
    time = np.asarray(time, dtype=float)
    if len(time) < 4:
        raise ValueError(f"{len(time)} samples lie in the steady state; at least 4 are needed")
    interval = (time[-1] - time[0]) / (len(time) - 1)
    if not np.allclose(np.diff(time), interval, rtol=1e-3):
        raise ValueError("the samples are unevenly spaced in time")
    return float(interval)


def settling_velocities(trajectory: xr.Dataset, start: float) -> tuple[np.ndarray, float]:
    """Downward velocities (frames, n) [v_s] of all particles from `start` [tau] on.

    Also returns the interval between frames [tau]. Raises ValueError where fewer than four frames
    lie after `start`, or they are uneven.
    """
    part = from_time(trajectory, start, "frame")
    return -part["velocities"][:, :, 2].values.astype(float), even_interval(part["time"])


def steady_state(
    runs: Iterable[xr.Dataset], start: float, quantity="settling_velocity_mean", confidence=0.95
) -> pd.DataFrame:
    """Average a series quantity from `start` on, with a confidence interval, for each case.

    Parameters: `runs`, series datasets (dimension step; variables time [tau] and `quantity`;
    attributes model, n, volume_fraction, galileo), `start` [tau]. Runs of one case that differ by
    seed are combined: from three on by the spread between them, below that by the error within
    each (`mean_of_runs`). Within a run it comes from batch means (`mean_with_interval`). A dilute
    cloud keeps its random start for the whole run, though, and time tells nothing of how another
    start would settle; so for means over particles the error is at least that of a mean over n
    particles with the measured variance.

    Returns the columns model, n, volume_fraction, galileo, quantity, value, low, high,
    standard_error, degrees_of_freedom, correlation_time [tau], runs; sorted.

    Raises ValueError where the series lacks the quantity, an attribute, or ten steps after `start`.
    """
    cases: dict[tuple, list[tuple[Mean, float]]] = {}
    for run in runs:
        if quantity not in run:
            raise ValueError(f"the series has no variable {quantity!r}; it has {sorted(run)}")
        part = from_time(run, start, "step")
        mean = mean_with_interval(part[quantity].values, confidence)
        if quantity in PARTICLE_MEANS:
            variance = float(part["settling_velocity_variance"].mean())
            spread = SHARED_NEIGHBOURS * np.sqrt(variance / case_of(run)["n"])
            if spread > mean.standard_error:
                freedom = case_of(run)["n"] - 1
                mean = replace(mean, standard_error=spread, degrees_of_freedom=freedom)
        time = part["time"].values.astype(float)
        interval = (time[-1] - time[0]) / (len(time) - 1)
        cases.setdefault(tuple(case_of(run).values()), []).append((mean, interval))
    if not cases:
        raise ValueError("there are no runs: at least one series is needed")
    rows = []
    for case, entries in sorted(cases.items()):
        mean = mean_of_runs([m for m, _ in entries])
        rows.append(
            dict(zip(CASE, case, strict=True))
            | {
                "quantity": quantity,
                "value": mean.value,
                "low": mean.value - mean.half_width,
                "high": mean.value + mean.half_width,
                "standard_error": mean.standard_error,
                "degrees_of_freedom": mean.degrees_of_freedom,
                "correlation_time": float(
                    np.mean([m.correlation_length * dt for m, dt in entries])
                ),
                "runs": len(entries),
            }
        )
    return pd.DataFrame(rows)


def inverse_beta_table(steady: pd.DataFrame) -> pd.DataFrame:
    """Put the steady settling velocities beside the paper's, the random start and Batchelor's law.

    Parameters: `steady` as `steady_state` returns it; the rows of the lowest Galileo number of
    each (model, n, phi) are kept. Returns the columns source, model, n, volume_fraction, value,
    low, high, runs, with source "simulation", "paper", "random start", "Batchelor 1972" or "Del
    Bello 2017".

    Raises ValueError for an empty table.
    """
    if steady.empty:
        raise ValueError("the table of steady states is empty")
    kept = steady.sort_values("galileo").drop_duplicates(["model", "n", "volume_fraction"])
    simulation = kept.sort_values(["model", "n", "volume_fraction"]).assign(source="simulation")
    phi = np.logspace(-8, -3, 51)
    batchelor = pd.DataFrame({"volume_fraction": phi, "value": 1 + BATCHELOR_COEFFICIENT * phi})
    table = pd.concat(
        [
            simulation,
            PAPER_STEADY_STATE.assign(source="paper"),
            RANDOM_START.assign(source="random start"),
            batchelor.assign(source="Batchelor 1972"),
            pd.DataFrame([DEL_BELLO]).assign(source="Del Bello 2017"),
        ],
        ignore_index=True,
    )
    return table[["source", "model", "n", "volume_fraction", "value", "low", "high", "runs"]]


def settling_in_time(runs: Iterable[xr.Dataset], points=500) -> pd.DataFrame:
    """Tabulate mean and variance over particles of the settling velocity against time.

    Parameters: `runs`, series datasets; `points`, the most rows a run keeps (evenly spaced steps,
    first and last among them). Of each (model, n, phi) the runs of the lowest Galileo number are
    kept, and of these the one of the lowest random stream.

    Returns the columns model, n, volume_fraction, galileo, seed, time [tau], mean [v_s],
    variance [v_s^2]. Raises ValueError where there is no run or an attribute is missing.
    """
    chosen: dict[tuple, tuple] = {}
    for run in runs:
        case, seed = case_of(run), int(run.attrs.get("stream", 0))
        key = (case["model"], case["n"], case["volume_fraction"])
        if key not in chosen or (case["galileo"], seed) < chosen[key][:2]:
            chosen[key] = (case["galileo"], seed, run)
    if not chosen:
        raise ValueError("there are no runs: at least one series is needed")
    tables = []
    for key in sorted(chosen):
        _, seed, run = chosen[key]
        steps = run.sizes["step"]
        kept = np.unique(np.linspace(0, steps - 1, min(points, steps)).round().astype(int))
        part = run.isel(step=kept)
        columns = {
            "time": part["time"].values,
            "mean": part["settling_velocity_mean"].values,
            "variance": part["settling_velocity_variance"].values,
        }
        tables.append(pd.DataFrame(case_of(run) | {"seed": seed} | columns))
    return pd.concat(tables, ignore_index=True)


def tracked_trajectories(runs: Iterable[xr.Dataset], points=1000) -> pd.DataFrame:
    """Tabulate the unwrapped paths of the tracked particles.

    Parameters: `runs`, series datasets with tracked_position (step, tracked, spatial) [d_p];
    `points`, the most rows a particle keeps. Returns the columns volume_fraction, n, particle
    (from 1), time [tau], x, y, z [d_p] and dx, dy, dz, the displacement since the first step.

    Raises ValueError where there is no run, or a run has fewer than two steps.
    """
    tables = []
    for run in runs:
        steps = run.sizes["step"]
        if steps < 2:
            raise ValueError(f"a path needs at least two steps; the run has {steps}")
        kept = np.unique(np.linspace(0, steps - 1, min(points, steps)).round().astype(int))
        time = run["time"].values[kept]
        position = run["tracked_position"].transpose("step", "tracked", "spatial").values
        for particle in range(position.shape[1]):
            path = position[kept, particle].astype(float)
            columns = {"time": time}
            columns |= dict(zip("xyz", path.T, strict=True))
            columns |= dict(zip(("dx", "dy", "dz"), (path - path[0]).T, strict=True))
            case = case_of(run)
            head = {k: case[k] for k in ("volume_fraction", "n")} | {"particle": particle + 1}
            tables.append(pd.DataFrame(head | columns))
    if not tables:
        raise ValueError("there are no runs: at least one series is needed")
    table = pd.concat(tables, ignore_index=True)
    return table.sort_values(["volume_fraction", "particle", "time"], ignore_index=True)
