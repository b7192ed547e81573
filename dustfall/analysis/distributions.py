"""Distributions of the force over the data set: samples, p.d.f. per decade of phi, summary."""

import numpy as np
import pandas as pd
import scipy

from dustfall.analysis.references import PAPER_FORCE_SUMMARY
from dustfall.units import AXES, COMPONENTS, STOKES_DRAG

FEWEST_SAMPLES = 5
"""A decade or a slice with fewer samples than this has no density worth drawing."""

LAWS = {"laplace": ("laplace", 0.93), "normal": ("norm", 0.895)}
"""Laws that are fitted to samples, as scipy names them, and their Kolmogorov-Smirnov levels: a law
fitted to m of its own independent samples lies farther from them than this over sqrt(m) in one case
of twenty (one that was not fitted: 1.36). Laplace: simulated, 0.937 and 0.935, each to 0.005, at
m = 1,000 and 8,000 (method: Puig & Stephens 2000, Technometrics 42, 417). Normal: Lilliefors 1967,
with the number of Stephens 1974 (J. Am. Stat. Assoc. 69, 730); simulated 0.903, to 0.005."""

SILVERMAN = (0.9, 1.34)
"""Width of a Gaussian kernel over m^(-1/5) min(deviation, interquartile range / 1.34), and that
range of a normal law over its deviation (Silverman 1986, Eqs. 3.30 and 3.31)."""

KERNEL_REACH = 3
"""Kernel widths that a density is drawn beyond the outermost samples."""

NEAREST = 10
"""A kernel is as wide as the distance of this nearest sample at least: those that fit the peak of a
dilute slice would leave its long tails in pieces."""


def force_samples(volume_fraction, force, number=1000) -> pd.DataFrame:
    """Choose at most `number` samples, evenly spaced in the rank of their volume fraction.

    Parameters: `volume_fraction` (m,), `force` (m, 3) in Re_p c_D. The choice depends on the data
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
            for component, column in AXES.items()
        ],
        ignore_index=True,
    )


def force_distributions(volume_fraction, force, points=400) -> pd.DataFrame:
    """Estimate the p.d.f. of each force component in a slice about each power of ten of phi.

    Parameters: `volume_fraction` (m,), `force` (m, 3) in Re_p c_D, `points` a curve, half of them
    at equal shares of the samples and half at equal distances. Gaussian kernels of Silverman's
    robust width, wider where forces are rare (variable kernels, Silverman 1986, section 2.6).
    Neighbours lower the drag: where no sample exceeds Stokes drag, the streamwise density ends
    there, and what kernels put beyond is folded back (reflection, section 2.10). Slices with fewer
    than `FEWEST_SAMPLES` samples are left out.

    Returns the columns component, slice (the power of ten), phi_low, phi_high, samples, force,
    density [1/(Re_p c_D)], and for the lateral components laplace_density, the Laplace law fitted
    to both of them, with its Kolmogorov-Smirnov distance laplace_ks and laplace_ks_level, which the
    fitted law of as many independent samples exceeds in one case of twenty.

    Raises ValueError for bad arrays, or where no slice has samples enough.
    """
    volume_fraction, force = check_forces(volume_fraction, force)
    tables = []
    for exponent, inside in slices(volume_fraction):
        if inside.sum() < FEWEST_SAMPLES:
            continue
        own = volume_fraction[inside]
        law = fit("laplace", force[inside][:, COMPONENTS["lateral"]])
        for component, column in AXES.items():
            values = force[inside, column]
            curve = {"component": component, "slice": 10.0**exponent}
            curve |= {"phi_low": own.min(), "phi_high": own.max(), "samples": len(values)}
            if column in COMPONENTS["lateral"]:
                x, density = _kernel_density(values, points)
                curve |= {
                    "laplace_density": scipy.stats.laplace.pdf(x, law["location"], law["scale"]),
                    "laplace_ks": law["ks"],
                    "laplace_ks_level": law["ks_level"],
                }
            else:
                x, density = _kernel_density(values, points, STOKES_DRAG)
            tables.append(pd.DataFrame(curve | {"force": x, "density": density}))
    if not tables:
        raise ValueError(
            f"no slice of the volume fraction has {FEWEST_SAMPLES} samples; "
            f"there are {len(volume_fraction)} in all"
        )
    columns = ["component", "slice", "phi_low", "phi_high", "samples", "force", "density"]
    columns += ["laplace_density", "laplace_ks", "laplace_ks_level"]
    return pd.concat(tables, ignore_index=True)[columns]


def force_summary(volume_fraction, force) -> pd.DataFrame:
    """Tabulate the figures that the paper states of its forces, overall and per decade of phi.

    Parameters: `volume_fraction` (m,), `force` (m, 3) in Re_p c_D. Returns the columns quantity,
    component, phi_low, phi_high, samples, value, paper (NaN where the paper has none). Quantities:
    shares of samples at least 15 % and 34 % below Stokes drag, the reductions that 30 % and 10 %
    of the samples exceed, mean, variance, and for the lateral components (each, and both as
    "lateral") the scale of the fitted Laplace law, the Kolmogorov-Smirnov distances of it and of
    the fitted normal law with their levels (`fit`), and the excess kurtosis (Laplace: 3, normal:
    0). Both lateral forces of a scene grow with it, so the levels of "lateral" are too low.

    Raises ValueError for bad arrays.
    """
    volume_fraction, force = check_forces(volume_fraction, force)
    everything = np.ones(len(volume_fraction), bool)
    groups = [(volume_fraction.min(), volume_fraction.max(), everything)]
    groups += [g for g in decades(volume_fraction) if g[2].sum() >= FEWEST_SAMPLES]
    rows = []
    for low, high, inside in groups:
        samples = {name: force[inside, column] for name, column in AXES.items()}
        samples["lateral"] = force[inside][:, COMPONENTS["lateral"]].ravel()
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
                laws = {name: fit(name, values) for name in LAWS}
                figures |= {
                    "laplace_scale": laws["laplace"]["scale"],
                    "laplace_ks": laws["laplace"]["ks"],
                    "laplace_ks_level": laws["laplace"]["ks_level"],
                    "normal_ks": laws["normal"]["ks"],
                    "normal_ks_level": laws["normal"]["ks_level"],
                    "excess_kurtosis": scipy.stats.kurtosis(values),
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


def fit(law: str, values) -> dict[str, float]:
    """Fit a law of `LAWS` to values by maximum likelihood.

    Returns location and scale (Laplace: median and mean absolute deviation from it; normal: mean
    and standard deviation), the Kolmogorov-Smirnov distance ks between sample and fitted law, and
    its level ks_level, which the fit to as many independent samples of the law itself exceeds in
    one case of twenty.

    Raises ValueError for fewer than two values or values that are all equal.
    """
    values = np.asarray(values, dtype=float).ravel()
    if values.size < 2 or np.ptp(values) == 0:
        raise ValueError(f"a {law} law needs at least two different values, not {values.size}")
    name, level = LAWS[law]
    distribution = getattr(scipy.stats, name)
    location, scale = distribution.fit(values)
    # The p-value, which holds for a law that was not fitted, is not used; this one costs the least.
    found = scipy.stats.ks_1samp(values, distribution.cdf, (location, scale), method="asymp")
    return {
        "location": float(location),
        "scale": float(scale),
        "ks": float(found.statistic),
        "ks_level": level / np.sqrt(values.size),
    }


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


def slices(volume_fraction: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Part volume fractions (m,) by the nearest power of ten: (exponent, inside (m,)) of each.

    So a range from 1e-9 to 1e-3 has the seven slices of the paper's densities, of which the first
    and the last are half a decade wide, and the others one.
    """
    exponent = np.round(np.log10(volume_fraction)).astype(int)
    return [(e, exponent == e) for e in np.unique(exponent).tolist()]


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


def _kernel_density(values, points, bound=np.inf):
    """Places (points,) and density there; where no value exceeds `bound`, the density ends at it.

    Raises ValueError where all values are equal.
    """
    factor, normal_range = SILVERMAN
    deviation = values.std()
    if deviation == 0:
        raise ValueError(f"all {len(values)} forces of a slice are {values[0]}: no density")
    # Half of the values may be equal (forces 24 of a dilute slice): then the deviation counts.
    spread = min(deviation, scipy.stats.iqr(values) / normal_range) or deviation
    values = np.sort(values)
    widths = np.fmax(factor * spread * len(values) ** -0.2, _nearest_distance(values))
    low = (values - KERNEL_REACH * widths).min()
    high = (values + KERNEL_REACH * widths).max()
    folded = values.max() <= bound < high
    high = bound if folded else high
    dense = np.quantile(values, np.linspace(0, 1, points // 2))
    x = np.sort(np.concatenate([dense, np.linspace(low, high, points - len(dense))]))
    density = _kernels(x, values, widths)
    return x, density + _kernels(2 * bound - x, values, widths) if folded else density


def _nearest_distance(values):
    """Distance of each of the sorted values (m,) from its `NEAREST`-th nearest, or the farthest."""
    m = len(values)
    nearest = min(NEAREST, m - 1)
    # The nearest samples of a sorted one stand on its two sides: at most so many on either.
    beside = np.arange(m)[:, None] + np.arange(-nearest, nearest + 1)
    distance = np.abs(values[np.clip(beside, 0, m - 1)] - values[:, None])
    distance[(beside < 0) | (beside >= m)] = np.inf
    return np.sort(distance, axis=1)[:, nearest]


def _kernels(x, values, widths):
    """Mean at x of normal densities of their own widths about the values."""
    exponent = ((x[:, None] - values) / widths) ** 2
    return (np.exp(-0.5 * exponent) / widths).mean(axis=1) / np.sqrt(2 * np.pi)
