"""Voronoï cells of the particles: volumes, their p.d.f. and variance, and the reference laws."""

from collections.abc import Iterable

import numpy as np
import pandas as pd
import scipy
import xarray as xr

from dustfall.analysis.references import (
    MATCHED_GAMMA,
    PAPER_GAMMA,
    PAPER_SETTLING,
    POISSON_VORONOI_VARIANCE,
)
from dustfall.analysis.settling import CASE, STEADY, case_of
from dustfall.analysis.time_averages import correlation_length
from dustfall.extras import extra
from dustfall.sedimentation.start import random_positions
from dustfall.sedimentation.state import box_length
from dustfall.streams import Purpose, stream

with extra("analysis"):
    import freud

VOLUME_EDGES = np.linspace(0, 4, 41)
"""Bins of V/mean(V); of a Poisson process fewer than one cell in 10^5 is larger."""

RESAMPLES = 1000
"""Of a bootstrap: the ends of its 95 % interval then scatter by a few per cent of its width."""

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


def cell_volumes(trajectory: xr.Dataset, start=0.0, snapshots=50, progress=None) -> xr.Dataset:
    """Voronoï volumes over their mean, in the first frame and some frames from `start` [tau] on.

    Parameters: `trajectory` with coordinates (frame, atom, spatial), cell_lengths (frame,
    cell_spatial) and time (frame) [tau]; `snapshots`, the most frames from `start` on, evenly
    spaced. Returns time (frame) [tau] and volume (frame, atom), with the trajectory's attributes.
    Raises ValueError where no frame lies after `start`.
    """
    time = np.asarray(trajectory["time"], dtype=float)
    later = np.flatnonzero(time >= start)
    if not later.size:
        raise ValueError(
            f"no frame lies at or after {start} tau; the trajectory has {time.min()} to "
            f"{time.max()} tau"
        )
    if later.size > snapshots:
        later = later[np.linspace(0, later.size - 1, snapshots).round().astype(int)]
    frames = np.union1d([0], later)
    volumes = []
    for done, frame in enumerate(frames, start=1):
        lengths = np.asarray(trajectory["cell_lengths"][frame], dtype=float)
        volume = voronoi_volumes(trajectory["coordinates"][frame].values, lengths)
        volumes.append(volume / volume.mean())
        if progress:
            progress(done, frames.size)
    data = {"time": ("frame", time[frames]), "volume": (("frame", "atom"), np.array(volumes))}
    return xr.Dataset(data, attrs=trajectory.attrs)


def pooled_volumes(runs, frames=slice(1, None)) -> np.ndarray:
    """Normalised volumes (k, n times runs) of some frames, of runs that differ by seed.

    `runs` as `cell_volumes` returns them, whose first frame is the start.
    """
    volumes = [run["volume"].values[frames] for run in runs]
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
        rng = stream(Purpose.RANDOM_SPHERES, seed, cloud)
        positions = random_positions(rng, particles, volume_fraction)
        volumes = voronoi_volumes(positions, box_length(particles, volume_fraction))
        found.append(volumes.var() / volumes.mean() ** 2)
    half = scipy.stats.t.ppf(0.975, clouds - 1) * np.std(found, ddof=1) / np.sqrt(clouds)
    mean = float(np.mean(found))
    return {"value": mean, "low": mean - half, "high": mean + half}


def random_sphere_table(
    volume_fractions: Iterable[float], seed: int, particles=10_000, clouds=REFERENCE_CLOUDS
) -> pd.DataFrame:
    """Tabulate `random_sphere_variance`: volume_fraction, n, value, low, high."""
    rows = [
        {"volume_fraction": phi, "n": particles}
        | random_sphere_variance(phi, particles, seed, clouds)
        for phi in volume_fractions
    ]
    return pd.DataFrame(rows)


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
    rng = stream(Purpose.BOOTSTRAP, seed, k)
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
    half = scipy.stats.norm.ppf(0.975) * error
    mean = by_snapshot.mean(axis=0)
    return np.fmin(low, mean - half), np.fmax(high, mean + half)


def voronoi_pdf_table(cells: Iterable[xr.Dataset], seed: int) -> pd.DataFrame:
    """Tabulate the p.d.f. of normalised Voronoï volumes for each Galileo number.

    Parameters: `cells` as `cell_volumes` returns them, of one volume fraction, one or, with several
    seeds, more for each Galileo number; `seed` of the bootstrap.

    Returns the columns source, galileo_multiple, volume, density, low, high. Sources: "settling"
    (over the window, one curve a Galileo number, as a multiple of the lowest), "random start"
    (first frames at the lowest), "gamma, k = 5, theta = 0.2" and "gamma, k = 5.59".

    Raises ValueError where there are no cells or an attribute is missing.
    """
    by_galileo = {case[-1]: runs for case, runs in sorted(_cases(cells).items())}
    lowest = min(by_galileo)
    initial = volume_distribution(pooled_volumes(by_galileo[lowest], slice(1)), seed)
    tables = [initial.assign(source="random start")]
    for galileo, runs in by_galileo.items():
        volumes = pooled_volumes(runs)
        tables.append(
            volume_distribution(volumes, seed).assign(
                source="settling", galileo_multiple=round(galileo / lowest, 6)
            )
        )
    x = np.linspace(0, VOLUME_EDGES[-1], 401)[1:]
    for name, (shape, scale) in {
        "gamma, k = 5, theta = 0.2": PAPER_GAMMA,
        "gamma, k = 5.59": MATCHED_GAMMA,
    }.items():
        density = scipy.stats.gamma.pdf(x, shape, scale=scale)
        tables.append(pd.DataFrame({"source": name, "volume": x, "density": density}))
    table = pd.concat(tables, ignore_index=True)
    return table[["source", "galileo_multiple", "volume", "density", "low", "high"]]


def _cases(cells) -> dict[tuple, list]:
    """Cells by case: those of one case differ by their seed."""
    cases: dict[tuple, list] = {}
    for run in cells:
        cases.setdefault(tuple(case_of(run).values()), []).append(run)
    if not cases:
        raise ValueError("there are no cells: those of at least one run are needed")
    return cases


def voronoi_variance_table(
    cells: Iterable[xr.Dataset],
    steady: pd.DataFrame,
    spheres: pd.DataFrame,
    seed: int,
) -> pd.DataFrame:
    """Tabulate the variance of normalised Voronoï volumes against the settling velocity.

    Parameters: `cells` as `cell_volumes` returns them, `steady` as `steady_state` returns it for
    the settling velocity of the same cases, `spheres` as `random_sphere_table` for their volume
    fractions, `seed` of the bootstrap.

    Returns the columns source, model, n, volume_fraction, galileo, status, variance, low, high (all
    over k theta^2 = 0.2 of the paper's gamma law), inverse_beta, inverse_beta_low,
    inverse_beta_high, relation and inverse_beta_relation ("=", or the bound that the paper
    states). Sources: "simulation", where a case that is not steady has the variance of its last
    frame and the velocity at its end; "random spheres" without overlap at the same phi, at the
    velocity of that phi's case with most particles; "random points", at each phi as well; and
    "paper".

    Raises ValueError where there are no cells, or `steady` or `spheres` lacks their case.
    """
    shape, scale = PAPER_GAMMA
    unit = shape * scale**2
    rows = []
    for key, runs in sorted(_cases(cells).items()):
        case = dict(zip(CASE, key, strict=True))
        same = (steady[list(case)] == pd.Series(case)).all(axis=1)
        if not same.any():
            raise ValueError(f"the table of steady states has no row for {case}")
        row = steady[same].iloc[0]
        settled = row["status"] == STEADY
        found = volume_variance(pooled_volumes(runs, slice(1 if settled else -1, None)), seed)
        rows.append(
            {"source": "simulation", "status": row["status"]}
            | case
            | _over(unit, found)
            | {
                "inverse_beta": row["value"] if settled else row["end"],
                "inverse_beta_low": row["low"],
                "inverse_beta_high": row["high"],
            }
        )
    simulation = pd.DataFrame(rows).sort_values(["galileo", "n"], ascending=[False, True])
    for phi, largest in simulation.groupby("volume_fraction").last().iterrows():
        head = {"volume_fraction": phi, "inverse_beta": largest["inverse_beta"]}
        found = spheres[spheres["volume_fraction"] == phi]
        if found.empty:
            raise ValueError(f"the table of random spheres has no row for phi = {phi:g}")
        source = {"source": "random spheres", "n": found.iloc[0]["n"]}
        rows.append(head | source | _over(unit, found.iloc[0]))
        points = {"source": "random points", "variance": POISSON_VORONOI_VARIANCE / unit}
        rows.append(head | points)
    table = pd.concat([pd.DataFrame(rows), _paper_points()])
    return table.sort_values(["source", "n", "volume_fraction", "galileo"], ignore_index=True)


def _paper_points() -> pd.DataFrame:
    """Variance and 1/beta of the paper side by side, each with its relation."""
    both = PAPER_SETTLING.pivot(index="volume_fraction", columns="quantity")
    return pd.DataFrame(
        {
            "source": "paper",
            "variance": both["value", "voronoi_variance"],
            "relation": both["relation", "voronoi_variance"],
            "inverse_beta": both["value", "inverse_beta"],
            "inverse_beta_relation": both["relation", "inverse_beta"],
        }
    ).reset_index()


def _over(unit, found) -> dict[str, float]:
    """The columns of a variance and its interval in another unit."""
    names = {"value": "variance", "low": "low", "high": "high"}
    return {name: found[key] / unit for key, name in names.items()}
