"""Settling velocity of the cloud: time series, what is steady of it, tracked particles."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr

from dustfall.analysis.references import DEL_BELLO, PAPER_SETTLING
from dustfall.analysis.time_averages import (
    ROUNDING,
    Mean,
    drift,
    drift_of_runs,
    mean_of_runs,
    mean_with_interval,
)
from dustfall.sedimentation.properties import mean_spacing
from dustfall.suspension.batchelor import BATCHELOR_COEFFICIENT

CASE = ("model", "n", "volume_fraction", "galileo")
"""Attributes that tell one case from another; runs that share them differ by their seed."""

PARTICLE_MEANS = ("settling_velocity_mean", "inverse_beta_mean")
"""Series that are means over particles of something that spreads like the settling velocity."""

SHARED_NEIGHBOURS = 1.3
"""Particles share neighbours, so the mean over n random ones spreads more than by 1/sqrt(n): 1.02
(phi = 1e-3) to 1.33 times (1e-8) as much, over 150 to 400 random starts of 200 and 1,000."""

STEADY, DRIFTING, TOO_SHORT = "steady", "drifting", "too short"
"""What the averaging window of a case shows: see `steadiness`."""

AVERAGES = ("value", "low", "high", "standard_error", "degrees_of_freedom")
"""Columns that a case without a steady state has no numbers in."""

DRIFT_LEVEL = 0.05
"""Probability that a steady case is taken for a drifting one, over both series that are tested."""

SHORTEST_WINDOW = 5.0
"""Mean spacings that particles must move through the cloud within a window: from a random start
mean and variance rise over the first ten or so, and a window of fewer cannot tell a slow rise from
a fluctuation, or shows the start itself."""


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


def with_starts(
    runs: Iterable[xr.Dataset], starts: float | Sequence[float]
) -> list[tuple[xr.Dataset, float]]:
    """Each run with the start of its window [tau]; one start may be that of all.

    Raises ValueError for no run, or another number of starts than of runs.
    """
    runs = list(runs)
    if not runs:
        raise ValueError("there are no runs: at least one is needed")
    each = (
        [float(starts)] * len(runs) if isinstance(starts, int | float | np.number) else list(starts)
    )
    if len(each) != len(runs):
        raise ValueError(f"there are {len(each)} starts of windows for {len(runs)} runs")
    return list(zip(runs, each, strict=True))


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
        raise ValueError(f"{len(time)} samples lie in the averaging window; at least 4 are needed")
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


def stokes_number(run: xr.Dataset) -> float:
    """v_s tau / d_p of a run; ValueError where it has none."""
    if "stokes_number" not in run.attrs:
        raise ValueError("the dataset lacks the attribute 'stokes_number'")
    return float(run.attrs["stokes_number"])


def steadiness(windows: Sequence[xr.Dataset]) -> tuple[str, float]:
    """Whether the runs of a case are steady: their averaging windows, series datasets, tell.

    One test for all cases, whatever their closure and duration.

    Returns `STEADY`, `DRIFTING` or `TOO_SHORT`, and how many mean spacings of the cloud a particle
    of one standard deviation in velocity moves through it within the window. With fewer than
    `SHORTEST_WINDOW` it is too short, whatever the series look like: time in a dilute cloud is
    counted in these, not in response times. Otherwise a case drifts where mean or variance of
    the settling velocity change along the window (`time_averages.drift`), each at half of
    `DRIFT_LEVEL` (Bonferroni). Where all particles have one velocity there is nothing to spread:
    such a cloud is never too short, and its mean alone is tested, at the same level.
    """
    variance = np.mean([float(window["settling_velocity_variance"].mean()) for window in windows])
    mean = np.mean([float(window["settling_velocity_mean"].mean()) for window in windows])
    spread = np.sqrt(max(float(variance), 0.0))
    spacing = mean_spacing(case_of(windows[0])["volume_fraction"])
    duration = np.mean([np.ptp(window["time"].values) for window in windows])
    moved = float(spread * stokes_number(windows[0]) * duration / spacing)
    tested = ["settling_velocity_mean", "settling_velocity_variance"]
    level = DRIFT_LEVEL / len(tested)
    if spread <= ROUNDING * abs(mean):
        tested = tested[:1]
    elif moved < SHORTEST_WINDOW:
        return TOO_SHORT, moved
    drifts = [drift_of_runs([drift(w[name].values) for w in windows]) for name in tested]
    drifting = any(d.p_value < level for d in drifts)
    return (DRIFTING if drifting else STEADY), moved


def steady_state(
    runs: Iterable[xr.Dataset],
    starts: float | Sequence[float],
    quantities: Sequence[str] = ("settling_velocity_mean",),
    confidence=0.95,
) -> pd.DataFrame:
    """Average series quantities over a window, with confidence intervals, for each steady case.

    Parameters: `runs`, series datasets (dimension step; variables time [tau], the mean and
    variance of the settling velocity, and `quantities`; attributes model, n, volume_fraction,
    galileo, stokes_number), `starts` of their windows [tau], one for each run or one for all. Runs
    of one case that differ by seed are combined: from
    three on by the spread between them, below that by the error within each (`mean_of_runs`).
    Within a run it comes from batch means (`mean_with_interval`). A dilute cloud keeps its random
    start for the whole run, though, and time tells nothing of how another start would settle; so
    for means over particles the error is at least that of a mean over n particles with the
    measured variance.

    Returns the columns model, n, volume_fraction, galileo, quantity, status (`steadiness`), value,
    low, high, standard_error, degrees_of_freedom, correlation_time [tau], first (at the first
    step of the runs, before the particles move), end and drift (of the line fitted to the window:
    its last value, and its change over the window), drift_error (standard error), window (its
    length [tau]), spacings (moved within it), runs; sorted by quantity and case. A case that is
    not steady has no average: value, low, high, standard_error and degrees_of_freedom are NaN.

    Raises ValueError where a series lacks the first quantity, an attribute, or ten steps after
    `start`.
    """
    cases: dict[tuple, list[tuple[xr.Dataset, xr.Dataset]]] = {}
    for run, start in with_starts(runs, starts):
        if quantities[0] not in run:
            raise ValueError(
                f"the series has no variable {quantities[0]!r}; it has {sorted(map(str, run))}"
            )
        cases.setdefault(tuple(case_of(run).values()), []).append(
            (run, from_time(run, start, "step"))
        )
    rows = []
    for case, pairs in sorted(cases.items()):
        own, windows = map(list, zip(*pairs, strict=True))
        status, spacings = steadiness(windows)
        # What only some closures measure has rows for their cases alone.
        for quantity in (name for name in quantities if all(name in run for run in own)):
            means = [_mean(window, quantity, confidence) for window in windows]
            trend = drift_of_runs([drift(window[quantity].values) for window in windows])
            mean = mean_of_runs(means)
            row = dict(zip(CASE, case, strict=True)) | {"quantity": quantity, "status": status}
            row |= {
                "value": mean.value,
                "low": mean.value - mean.half_width,
                "high": mean.value + mean.half_width,
                "standard_error": mean.standard_error,
                "degrees_of_freedom": mean.degrees_of_freedom,
            }
            if status != STEADY:
                row |= dict.fromkeys(AVERAGES, np.nan)
            rows.append(
                row
                | {
                    "correlation_time": float(
                        np.mean(
                            [
                                m.correlation_length * even_interval(window["time"])
                                for m, window in zip(means, windows, strict=True)
                            ]
                        )
                    ),
                    "first": float(np.mean([run[quantity].values[0] for run in own])),
                    "end": trend.end,
                    "drift": trend.change,
                    "drift_error": trend.standard_error,
                    "window": float(np.mean([np.ptp(w["time"].values) for w in windows])),
                    "spacings": spacings,
                    "runs": len(own),
                }
            )
    table = pd.DataFrame(rows)
    order = table["quantity"].map(list(quantities).index)
    return table.iloc[np.argsort(order, kind="stable")].reset_index(drop=True)


def _mean(window: xr.Dataset, quantity: str, confidence: float) -> Mean:
    """Mean of one run over its window, whose error covers that of its random start."""
    mean = mean_with_interval(window[quantity].values, confidence)
    if quantity not in PARTICLE_MEANS:
        return mean
    variance = float(window["settling_velocity_variance"].mean())
    particles = case_of(window)["n"]
    spread = SHARED_NEIGHBOURS * np.sqrt(variance / particles)
    if spread <= mean.standard_error:
        return mean
    return replace(mean, standard_error=spread, degrees_of_freedom=particles - 1)


def inverse_beta_table(steady: pd.DataFrame) -> pd.DataFrame:
    """Put the settling velocities beside the paper's, the random start and Batchelor's law.

    Parameters: `steady` as `steady_state` returns it, with the quantities settling_velocity_mean
    and inverse_beta_mean; the rows of the lowest Galileo number of each (model, n, phi) are kept.

    Returns the columns source, model, n, volume_fraction, value, low, high, status, drift,
    relation, runs. Sources: "simulation" (settling velocity; of a case that is not steady its end
    and its drift, without an interval), "random start" (mean of 1/beta before the particles move),
    "paper" (relation "=", or ">=" where it states a bound), "Batchelor 1972", and "Del Bello
    2017", a range.

    Raises ValueError for an empty table.
    """
    if steady.empty:
        raise ValueError("the table of steady states is empty")
    key = ["model", "n", "volume_fraction"]
    kept = steady.sort_values("galileo").drop_duplicates(["quantity", *key]).sort_values(key)
    simulation = kept[kept["quantity"] == "settling_velocity_mean"]
    start = kept[kept["quantity"] == "inverse_beta_mean"]
    phi = np.logspace(-8, -3, 51)
    batchelor = pd.DataFrame({"volume_fraction": phi, "value": 1 + BATCHELOR_COEFFICIENT * phi})
    paper = PAPER_SETTLING[PAPER_SETTLING["quantity"] == "inverse_beta"]
    steady_value = simulation["value"].fillna(simulation["end"])
    table = pd.concat(
        [
            simulation.assign(source="simulation", value=steady_value),
            start[[*key, "runs"]].assign(source="random start", value=start["first"]),
            paper.assign(source="paper"),
            batchelor.assign(source="Batchelor 1972"),
            pd.DataFrame([DEL_BELLO]).assign(source="Del Bello 2017"),
        ],
        ignore_index=True,
    )
    columns = ["source", *key, "value", "low", "high", "status", "drift", "relation", "runs"]
    return table[columns]


def settling_in_time(runs: Iterable[xr.Dataset], points=500) -> pd.DataFrame:
    """Tabulate mean and variance over particles of the settling velocity against time.

    Parameters: `runs`, series datasets; `points`, the most rows a run keeps (evenly spaced steps,
    first and last among them). Of each (model, n, phi) the runs of the lowest Galileo number are
    kept, and of these the one of the lowest random stream.

    Returns the columns model, n, volume_fraction, galileo, seed, time [tau], spreading_times (the
    same in units of `Properties.spreading_time`), mean [v_s], variance [v_s^2]. Raises ValueError
    where there is no run or an attribute is missing.
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
        unit = mean_spacing(key[2]) ** 2 / stokes_number(run)
        columns = {
            "time": part["time"].values,
            "spreading_times": part["time"].values / unit,
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
