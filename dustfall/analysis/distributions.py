"""Distributions of the force over the data set: samples, p.d.f. per decade of phi, summary."""

import numpy as np
import pandas as pd
from scipy import stats

from dustfall.analysis.references import PAPER_FORCE_SUMMARY
from dustfall.units import STOKES_DRAG

COMPONENTS = {"spanwise": 0, "streamwise": 1, "vertical": 2}
"""Column of each component in a force array: x spanwise, y streamwise, z vertical."""

FEWEST_SAMPLES = 5
"""A decade with fewer samples than this has no density worth drawing."""


def force_samples(volume_fraction, force, number=1000) -> pd.DataFrame:
    """Choose at most `number` samples, evenly spaced in the rank of their volume fraction.

    Parameters: `volume_fraction` (m,), `force` (m, 3) in Re_p c_D. The choice hangs on the data
    alone. Returns the columns volume_fraction, component, force: one row a sample and component.

    Raises ValueError for mismatched shapes, values that are not finite and `number` below one.
    """
    volume_fraction, force = check_forces(volume_fraction, force)
    if number < 1:
        raise ValueError(f"number of samples is {number}; it must be at least 1")
    chosen = np.argsort(volume_fraction, kind="stable")
    if len(chosen) > number:
        chosen = chosen[np.linspace(0, len(chosen) - 1, number).round().astype(int)]
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "volume_fraction": volume_fraction[chosen],
                    "component": component,
                    "force": force[chosen, column],
                }
            )
            for component, column in COMPONENTS.items()
        ],
        ignore_index=True,
    )


def force_distributions(volume_fraction, force, points=400) -> pd.DataFrame:
    """Estimate the p.d.f. of each force component in each decade of the volume fraction.

    Parameters: `volume_fraction` (m,), `force` (m, 3) in Re_p c_D, `points` a curve. Gaussian
    kernels of Silverman's robust width (Silverman 1986, Eq. 3.31). Decades with fewer than
    `FEWEST_SAMPLES` samples are left out.

    Returns the columns component, phi_low, phi_high, samples, force, density [1/(Re_p c_D)], and
    for the lateral components laplace_density, the Laplace law fitted to both of them, with its
    Kolmogorov-Smirnov distance laplace_ks.

    Raises ValueError for bad arrays, or where no decade has samples enough.
    """
    volume_fraction, force = check_forces(volume_fraction, force)
    tables = []
    for low, high, inside in decades(volume_fraction):
        if inside.sum() < FEWEST_SAMPLES:
            continue
        law = laplace_fit(force[inside][:, [0, 2]].ravel())
        for component, column in COMPONENTS.items():
            values = force[inside, column]
            lateral = component != "streamwise"
            x, density = _kernel_density(values, points)
            tables.append(
                pd.DataFrame(
                    {
                        "component": component,
                        "phi_low": low,
                        "phi_high": high,
                        "samples": len(values),
                        "force": x,
                        "density": density,
                        "laplace_density": stats.laplace.pdf(x, law["location"], law["scale"])
                        if lateral
                        else np.nan,
                        "laplace_ks": law["ks"] if lateral else np.nan,
                    }
                )
            )
    if not tables:
        raise ValueError(
            f"no decade of the volume fraction has {FEWEST_SAMPLES} samples; "
            f"there are {len(volume_fraction)} in all"
        )
    return pd.concat(tables, ignore_index=True)


def force_summary(volume_fraction, force) -> pd.DataFrame:
    """Tabulate the figures that the paper states of its forces, overall and per decade of phi.

    Parameters: `volume_fraction` (m,), `force` (m, 3) in Re_p c_D. Returns the columns quantity,
    component, phi_low, phi_high, samples, value, paper (NaN where the paper has none). Quantities:
    shares of samples at least 15 % and 34 % below Stokes drag, the reductions that 30 % and 10 %
    of the samples exceed, mean, variance, and for the lateral components (each, and both as
    "lateral") the scale of the fitted Laplace law, its Kolmogorov-Smirnov distance, the distance
    that one sample in twenty of a law would exceed (1.36/sqrt(m)), that of the fitted normal law
    beside it, and the excess kurtosis (Laplace: 3, normal: 0).

    Raises ValueError for bad arrays.
    """
    volume_fraction, force = check_forces(volume_fraction, force)
    everything = np.ones(len(volume_fraction), bool)
    groups = [(volume_fraction.min(), volume_fraction.max(), everything)]
    groups += [g for g in decades(volume_fraction) if g[2].sum() >= FEWEST_SAMPLES]
    rows = []
    for low, high, inside in groups:
        samples = {name: force[inside, column] for name, column in COMPONENTS.items()}
        samples["lateral"] = force[inside][:, [0, 2]].ravel()
        for component, values in samples.items():
            figures = {"mean": values.mean(), "variance": values.var()}
            if component == "streamwise":
                reduction = 1 - values / STOKES_DRAG
                figures |= {
                    "share_15_percent_below_stokes": (reduction >= 0.15).mean(),
                    "share_34_percent_below_stokes": (reduction >= 0.34).mean(),
                    "reduction_exceeded_by_30_percent": np.quantile(reduction, 0.7),
                    "reduction_exceeded_by_10_percent": np.quantile(reduction, 0.9),
                }
            elif np.ptp(values) > 0:
                law = laplace_fit(values)
                normal = ks_distance(values, stats.norm(values.mean(), values.std()))
                figures |= {
                    "laplace_scale": law["scale"],
                    "laplace_ks": law["ks"],
                    "ks_of_one_in_twenty": 1.36 / np.sqrt(len(values)),
                    "normal_ks": normal,
                    "excess_kurtosis": stats.kurtosis(values),
                }
            for quantity, value in figures.items():
                paper = PAPER_FORCE_SUMMARY.get((quantity, component), np.nan)
                rows.append(
                    {
                        "quantity": quantity,
                        "component": component,
                        "phi_low": low,
                        "phi_high": high,
                        "samples": len(values),
                        "value": value,
                        "paper": paper if inside is everything else np.nan,
                    }
                )
    return pd.DataFrame(rows)


def laplace_fit(values) -> dict[str, float]:
    """Fit a Laplace law by maximum likelihood: location, scale, Kolmogorov-Smirnov distance.

    The location is the median, the scale the mean absolute deviation from it. The distance `ks`
    is the largest gap between the empirical and the fitted distribution function (0: perfect).

    Raises ValueError for fewer than two values or values that are all equal.
    """
    values = np.asarray(values, dtype=float).ravel()
    if values.size < 2 or np.ptp(values) == 0:
        raise ValueError(f"a Laplace law needs at least two different values, not {values.size}")
    location = float(np.median(values))
    scale = float(np.abs(values - location).mean())
    ks = ks_distance(values, stats.laplace(location, scale))
    return {"location": location, "scale": scale, "ks": ks}


def ks_distance(values, law) -> float:
    """Largest gap between the empirical distribution function of values (m,) and that of a law."""
    below = np.arange(len(values)) / len(values)
    cumulative = law.cdf(np.sort(values))
    above = below + 1 / len(values)
    return float(max((cumulative - below).max(), (above - cumulative).max()))


def decades(volume_fraction: np.ndarray) -> list[tuple[float, float, np.ndarray]]:
    """Split volume fractions (m,) by decade: (low, high, inside (m,)) for each that has samples.

    A decade holds its lower end; a largest value that is a power of ten itself (the upper end of a
    campaign's range) belongs to the decade below it.
    """
    exponent = np.floor(np.log10(volume_fraction) + 1e-9).astype(int)
    top = exponent.max()
    at_upper_end = np.isclose(volume_fraction, 10.0**top, rtol=1e-9, atol=0)
    if (exponent < top).any() and at_upper_end[exponent == top].all():
        exponent[exponent == top] = top - 1
    return [(10.0**e, 10.0 ** (e + 1), exponent == e) for e in np.unique(exponent).tolist()]


def check_forces(volume_fraction, force) -> tuple[np.ndarray, np.ndarray]:
    """Return volume fractions (m,) and forces (m, 3) as float64, or raise ValueError."""
    volume_fraction = np.asarray(volume_fraction, dtype=float)
    force = np.asarray(force, dtype=float)
    if volume_fraction.ndim != 1 or force.shape != (volume_fraction.size, 3):
        raise ValueError(
            f"volume fractions have shape {volume_fraction.shape} and forces {force.shape}; "
            "they must be (m,) and (m, 3)"
        )
    if volume_fraction.size == 0:
        raise ValueError("there are no forces: at least one sample is needed")
    if not (np.isfinite(volume_fraction).all() and (volume_fraction > 0).all()):
        raise ValueError("volume fractions must be finite and above zero")
    if not np.isfinite(force).all():
        sample = int(np.flatnonzero(~np.isfinite(force).all(axis=1))[0])
        raise ValueError(f"the force of sample {sample} is not finite")
    return volume_fraction, force


def _kernel_density(values, points):
    spread = min(values.std(), np.subtract(*np.percentile(values, [75, 25])) / 1.349)
    if spread == 0:
        spread = values.std()
    if spread == 0:
        raise ValueError(f"all {len(values)} forces of a decade are {values[0]}: no density")
    width = 0.9 * spread * len(values) ** -0.2
    x = np.linspace(values.min() - 3 * width, values.max() + 3 * width, points)
    density = np.zeros(points)
    for part in np.array_split(values, max(1, len(values) // 2000)):
        density += np.exp(-0.5 * ((x[:, None] - part) / width) ** 2).sum(axis=1)
    return x, density / (len(values) * width * np.sqrt(2 * np.pi))
