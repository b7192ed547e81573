"""Voronoï cells of the particles: volumes, their p.d.f. and variance, and the reference laws."""

from collections.abc import Iterable

import freud
import numpy as np
import pandas as pd
import xarray as xr
from scipy import stats

from dustfall.analysis.references import (
    MATCHED_GAMMA,
    PAPER_GAMMA,
    PAPER_VORONOI_VARIANCE,
    POISSON_VORONOI_VARIANCE,
)
from dustfall.analysis.settling import CASE, case_of, correlation_length
from dustfall.sedimentation.start import cube_side, random_positions

VOLUME_EDGES = np.linspace(0, 4, 41)
"""Bins of V/mean(V); of a Poisson process fewer than one cell in 10^5 is larger."""

RESAMPLES = 1000

TOUCHING_CELLS = 1.3
"""Cells that touch are correlated: the variance of V/mean(V) of random points spreads between
realisations 1.2 to 1.4 times as much as that of independent cells (measured with 300, 1,000 and
3,000 points); the bins of the p.d.f. do not."""

REFERENCE_CLOUDS = 10
"""Random clouds that the reference of each volume fraction is averaged over."""


def voronoi_volumes(positions, cell_lengths) -> np.ndarray:
    """Volumes (n,) of the periodic Voronoï cells of points (n, 3) in a box with sides (3,).

    Positions may be unwrapped; volumes have the cube of their unit. freud computes the cells.

    Raises ValueError for a wrong shape, fewer than two points, values that are not finite or a
    side not above zero, and where the cells do not fill the box (coinciding points).
    """
    positions = np.asarray(positions, dtype=float)
    lengths = np.broadcast_to(np.asarray(cell_lengths, dtype=float), (3,))
    if positions.ndim != 2 or positions.shape[1] != 3 or len(positions) < 2:
        raise ValueError(f"positions have shape {positions.shape}; (n, 3) with n >= 2 needed")
    if not np.isfinite(positions).all():
        point = int(np.flatnonzero(~np.isfinite(positions).all(axis=1))[0])
        raise ValueError(f"the position of point {point} is not finite")
    if not (np.isfinite(lengths).all() and (lengths > 0).all()):
        raise ValueError(f"the box has sides {lengths.tolist()}; they must be above zero")
    # freud keeps single precision, so unwrapped positions are wrapped before they get there.
    fraction = positions / lengths
    wrapped = (fraction - np.floor(fraction) - 0.5) * lengths
    cells = freud.locality.Voronoi()
    cells.compute((freud.box.Box(*lengths), wrapped))
    volumes = np.array(cells.volumes, dtype=float)
    if not np.isclose(volumes.sum(), lengths.prod(), rtol=1e-4):
        raise ValueError(
            f"the cells fill {volumes.sum() / lengths.prod():.6f} of the box: points coincide"
        )
    return volumes


def snapshot_volumes(
    trajectory: xr.Dataset, start=0.0, stop=np.inf, snapshots=50, progress=None
) -> np.ndarray:
    """Voronoï volumes over their mean (k, n) of at most `snapshots` frames of a trajectory.

    Parameters: `trajectory` with coordinates (frame, atom, spatial), cell_lengths (frame,
    cell_spatial) and time (frame) [tau]; frames from `start` to `stop` [tau], evenly spaced.
    Raises ValueError where no frame lies between them.
    """
    time = np.asarray(trajectory["time"], dtype=float)
    frames = np.flatnonzero((time >= start) & (time <= stop))
    if not frames.size:
        raise ValueError(
            f"no frame lies between {start} and {stop} tau; the trajectory has "
            f"{time.min()} to {time.max()} tau"
        )
    if frames.size > snapshots:
        frames = frames[np.linspace(0, frames.size - 1, snapshots).round().astype(int)]
    volumes = []
    for done, frame in enumerate(frames, start=1):
        lengths = np.asarray(trajectory["cell_lengths"][frame], dtype=float)
        volume = voronoi_volumes(trajectory["coordinates"][frame].values, lengths)
        volumes.append(volume / volume.mean())
        if progress:
            progress(done, frames.size)
    return np.array(volumes)


def pooled_volumes(trajectories, start: float, snapshots=50, progress=None) -> np.ndarray:
    """Normalised volumes (k, n times runs) of runs of one case that differ by their seed."""
    volumes = [
        snapshot_volumes(t, start, snapshots=snapshots, progress=progress) for t in trajectories
    ]
    shortest = min(map(len, volumes))
    return np.concatenate([v[-shortest:] for v in volumes], axis=1)


def random_sphere_variance(
    volume_fraction: float, particles: int, seed: int, clouds=REFERENCE_CLOUDS
) -> dict[str, float]:
    """Variance of normalised volumes among random spheres that do not overlap.

    Parameters: `volume_fraction`, `particles` of a cloud, `seed`, `clouds` (at least two), placed
    one after the other at random (`sedimentation.start`). Returns value, low and high of the 95 %
    interval, Student's t between clouds.
    """
    found = []
    for cloud in range(clouds):
        rng = np.random.default_rng([seed, cloud])
        positions = random_positions(rng, particles, volume_fraction)
        volumes = voronoi_volumes(positions, cube_side(particles, volume_fraction))
        found.append(volumes.var() / volumes.mean() ** 2)
    half = stats.t.ppf(0.975, clouds - 1) * np.std(found, ddof=1) / np.sqrt(clouds)
    mean = float(np.mean(found))
    return {"value": mean, "low": mean - half, "high": mean + half}


def gamma_pdf(volume, shape, scale) -> np.ndarray:
    """Density of the gamma law with shape k and scale theta; its variance is k theta^2."""
    return stats.gamma.pdf(volume, shape, scale=scale)


def block_bootstrap(values, seed, length=1.0, confidence=0.95) -> tuple[np.ndarray, np.ndarray]:
    """Confidence interval of the mean over the first axis of correlated samples (k, ...).

    Circular block bootstrap (Politis & Romano 1992) with blocks of `length` samples, widened by
    sqrt(b/(b - 1)) for b independent blocks. With fewer than two blocks there is no interval: NaN.
    """
    values = np.asarray(values, dtype=float)
    k = len(values)
    block = int(np.ceil(length))
    blocks = k // block
    if blocks < 2:
        nothing = np.full(values.shape[1:], np.nan)
        return nothing, nothing
    rng = np.random.default_rng([seed, k])
    first = rng.integers(k, size=(RESAMPLES, blocks, 1))
    index = (first + np.arange(block)).reshape(RESAMPLES, -1) % k
    mean = values.mean(axis=0)
    means = np.array([values[i].mean(axis=0) for i in index])
    means = mean + np.sqrt(blocks / (blocks - 1)) * (means - mean)
    low, high = np.quantile(means, [0.5 - confidence / 2, 0.5 + confidence / 2], axis=0)
    return low, high


def volume_distribution(volumes, seed, edges=VOLUME_EDGES) -> pd.DataFrame:
    """Histogram density of normalised volumes (k, n) with its 95 % interval.

    Returns the columns volume (centre of the bin), density, low, high; for the interval see
    `volume_variance`.
    """
    volumes = np.atleast_2d(volumes)
    snapshots, particles = volumes.shape
    width = np.diff(edges)
    bins = np.searchsorted(edges, volumes, side="right") - 1
    inside = (bins >= 0) & (bins < len(width))
    row, column = np.nonzero(inside)
    by_snapshot = np.zeros((snapshots, len(width)))
    by_particle = np.zeros((particles, len(width)))
    np.add.at(by_snapshot, (row, bins[inside]), 1 / (particles * width[bins[inside]]))
    np.add.at(by_particle, (column, bins[inside]), 1 / (snapshots * width[bins[inside]]))
    length = correlation_length(volumes.var(axis=1))
    low, high = _interval(by_snapshot, by_particle, seed, length)
    centre = (edges[1:] + edges[:-1]) / 2
    density = by_snapshot.mean(axis=0)
    return pd.DataFrame(
        {"volume": centre, "density": density, "low": np.maximum(low, 0), "high": high}
    )


def volume_variance(volumes, seed) -> dict[str, float]:
    """Variance of normalised volumes (k, n): value, low, high of the 95 % interval.

    Cells of one snapshot are correlated, so snapshots are resampled, in blocks of the correlation
    length of their variance. A dilute cloud keeps its cells for the whole run, and its snapshots
    are one sample, not many: therefore the error is also taken from the spread between particles,
    each with its whole history, and the wider interval counts.
    """
    volumes = np.atleast_2d(volumes)
    by_snapshot = volumes.var(axis=1)
    by_particle = ((volumes - volumes.mean(axis=1, keepdims=True)) ** 2).mean(axis=0)
    length = correlation_length(by_snapshot)
    low, high = _interval(by_snapshot, by_particle, seed, length, TOUCHING_CELLS)
    return {"value": float(by_snapshot.mean()), "low": float(low), "high": float(high)}


def _interval(by_snapshot, by_particle, seed, length, correlated=1.0):
    """The wider one of the intervals of a mean from its snapshots (k, …) and particles (n, …)."""
    low, high = block_bootstrap(by_snapshot, seed, length)
    error = correlated * by_particle.std(axis=0, ddof=1) / np.sqrt(len(by_particle))
    half = stats.norm.ppf(0.975) * error
    mean = by_snapshot.mean(axis=0)
    return np.fmin(low, mean - half), np.fmax(high, mean + half)


def voronoi_pdf_table(
    trajectories: Iterable[xr.Dataset], start: float, seed: int, snapshots=50, progress=None
) -> pd.DataFrame:
    """Tabulate the p.d.f. of normalised Voronoï volumes for each Galileo number.

    Parameters: `trajectories` of one volume fraction, one or, with several seeds, more for each
    Galileo number; `start` of the steady state [tau]; `seed` of the bootstrap; `snapshots`, the
    most frames used of each.

    Returns the columns source, galileo_multiple, volume, density, low, high. Sources: "steady
    state" (one curve a Galileo number, as a multiple of the lowest), "random start" (first frames
    at the lowest), "gamma, k = 5, theta = 0.2" and "gamma, k = 5.59".

    Raises ValueError where there is no trajectory, no frame after `start` or an attribute missing.
    """
    by_galileo = {case[-1]: runs for case, runs in sorted(_cases(trajectories).items())}
    lowest = min(by_galileo)
    first = [trajectory.isel(frame=[0]) for trajectory in by_galileo[lowest]]
    initial = volume_distribution(pooled_volumes(first, 0.0), seed)
    tables = [initial.assign(source="random start")]
    for galileo, runs in by_galileo.items():
        volumes = pooled_volumes(runs, start, snapshots, progress)
        tables.append(
            volume_distribution(volumes, seed).assign(
                source="steady state", galileo_multiple=round(galileo / lowest, 6)
            )
        )
    x = np.linspace(0, VOLUME_EDGES[-1], 401)[1:]
    for name, law in {
        "gamma, k = 5, theta = 0.2": PAPER_GAMMA,
        "gamma, k = 5.59": MATCHED_GAMMA,
    }.items():
        density = gamma_pdf(x, *law)
        tables.append(pd.DataFrame({"source": name, "volume": x, "density": density}))
    table = pd.concat(tables, ignore_index=True)
    return table[["source", "galileo_multiple", "volume", "density", "low", "high"]]


def _cases(trajectories) -> dict[tuple, list]:
    """Trajectories by case: those of one case differ by their seed."""
    cases: dict[tuple, list] = {}
    for trajectory in trajectories:
        cases.setdefault(tuple(case_of(trajectory).values()), []).append(trajectory)
    if not cases:
        raise ValueError("there are no trajectories: at least one is needed")
    return cases


def voronoi_variance_table(
    trajectories: Iterable[xr.Dataset],
    steady: pd.DataFrame,
    start: float,
    seed: int,
    snapshots=50,
    reference_particles=10_000,
    progress=None,
) -> pd.DataFrame:
    """Tabulate the variance of normalised Voronoï volumes against the steady settling velocity.

    Parameters: `trajectories`, `steady` as `steady_state` returns it for the same cases, `start`
    of the steady state [tau], `seed` of the bootstrap and of the reference, `snapshots`, the most
    frames used of each, `reference_particles` of a cloud of random spheres.

    Returns the columns source, model, n, volume_fraction, galileo, variance, low, high (all over
    k theta^2 = 0.2 of the paper's gamma law), inverse_beta, inverse_beta_low, inverse_beta_high.
    Sources: "steady state"; "random spheres" without overlap at the same phi, at the velocity of
    that phi's case with most particles; "random points", at each phi as well; and "paper".

    Raises ValueError where there is no trajectory or `steady` lacks its case.
    """
    shape, scale = PAPER_GAMMA
    unit = shape * scale**2
    rows = []
    for key, runs in sorted(_cases(trajectories).items()):
        case = dict(zip(CASE, key, strict=True))
        same = (steady[list(case)] == pd.Series(case)).all(axis=1)
        if not same.any():
            raise ValueError(f"the table of steady states has no row for {case}")
        row = steady[same].iloc[0]
        found = volume_variance(pooled_volumes(runs, start, snapshots, progress), seed)
        rows.append(
            {"source": "steady state"}
            | case
            | _over(unit, found)
            | {
                "inverse_beta": row["value"],
                "inverse_beta_low": row["low"],
                "inverse_beta_high": row["high"],
            }
        )
    steady_rows = pd.DataFrame(rows).sort_values(["galileo", "n"], ascending=[False, True])
    for phi, largest in steady_rows.groupby("volume_fraction").last().iterrows():
        head = {"volume_fraction": phi, "inverse_beta": largest["inverse_beta"]}
        found = random_sphere_variance(phi, reference_particles, seed)
        spheres = {"source": "random spheres", "n": reference_particles}
        rows.append(head | spheres | _over(unit, found))
        points = {"source": "random points", "variance": POISSON_VORONOI_VARIANCE / unit}
        rows.append(head | points)
    table = pd.concat([pd.DataFrame(rows), PAPER_VORONOI_VARIANCE.assign(source="paper")])
    return table.sort_values(["source", "n", "volume_fraction", "galileo"], ignore_index=True)


def _over(unit, found) -> dict[str, float]:
    """The columns of a variance and its interval in another unit."""
    names = {"value": "variance", "low": "low", "high": "high"}
    return {name: found[key] / unit for key, name in names.items()}
