"""Averages of correlated time series: with an honest interval, and with a test for drift."""

from dataclasses import dataclass

import numpy as np
import scipy

FEWEST_BATCHES = 5
MOST_BATCHES = 30
FEWEST_VALUES = 2 * FEWEST_BATCHES
"""A shorter series has no interval."""

BATCH_LENGTH = 4
"""Length of a batch in correlation lengths: with it and at least five batches, 95 % intervals of
autoregressive series of 10 to 1,000 correlation times hold the true mean in 92 to 96 % of cases."""

FEWEST_SEEDS = 3
"""From this many independent runs on, the spread between them gives the interval."""

ROUNDING = 1e-6
"""Relative differences below this are rounding of numbers that were kept in single precision."""


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
            scipy.stats.t.ppf(0.5 + self.confidence / 2, self.degrees_of_freedom)
            * self.standard_error
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
    x = _checked(values)
    length = correlation_length(x)
    means, _ = _batch_means(x, length)
    error = scipy.stats.sem(means)
    return Mean(float(x.mean()), float(error), len(means) - 1, length, confidence)


def mean_of_runs(means: list[Mean]) -> Mean:
    """Combine the means of independent runs of one case.

    From three runs on, the spread between runs gives the standard error; below that, the errors
    within the runs do.
    """
    k = len(means)
    values = np.array([m.value for m in means])
    if k >= FEWEST_SEEDS:
        error = values.std(ddof=1) / np.sqrt(k)
        freedom: float = k - 1
    else:
        error = np.linalg.norm([m.standard_error for m in means]) / k
        freedom = sum(m.degrees_of_freedom for m in means)
    length = float(np.mean([m.correlation_length for m in means]))
    return Mean(float(values.mean()), float(error), freedom, length, means[0].confidence)


@dataclass(frozen=True)
class Drift:
    """How a series changes along a straight line over its whole length."""

    change: float
    """From the first to the last value of the line."""
    standard_error: float
    degrees_of_freedom: float
    end: float
    """Last value of the line."""

    @property
    def p_value(self) -> float:
        """Probability of a change at least as large in a series without drift (Student's t)."""
        if self.change == 0:
            return 1.0
        with np.errstate(divide="ignore"):
            t = np.abs(self.change) / np.float64(self.standard_error)
        return float(2 * scipy.stats.t.sf(t, self.degrees_of_freedom))


def drift(values) -> Drift:
    """Fit a straight line to a correlated, evenly sampled series (m,), with an honest error.

    The line is that of least squares through batch means, whose scatter about it gives the error;
    batches are of at least four correlation lengths of what is left without the drift, and 5 to 30.
    A change that is rounding beside the values counts as none.

    Raises ValueError for fewer than ten values or values that are not finite.
    """
    x = _checked(values)
    place = np.linspace(0, 1, x.size)
    along = np.polynomial.Polynomial.fit(place, x, 1)
    means, centres = _batch_means(x, correlation_length(x - along(place)))
    line = scipy.stats.linregress(centres, means)
    rounding = abs(line.slope) <= ROUNDING * np.abs(x).max()
    return Drift(
        change=0.0 if rounding else float(line.slope),
        # Of a constant series SciPy gives none.
        standard_error=float(np.nan_to_num(line.stderr)),
        degrees_of_freedom=len(means) - 2,
        end=float(line.intercept + line.slope),
    )


def drift_of_runs(drifts: list[Drift]) -> Drift:
    """Combine the drifts of independent runs of one case: their mean, by the errors within them."""
    k = len(drifts)
    return Drift(
        float(np.mean([d.change for d in drifts])),
        float(np.sqrt(sum(d.standard_error**2 for d in drifts)) / k),
        sum(d.degrees_of_freedom for d in drifts),
        float(np.mean([d.end for d in drifts])),
    )


def _checked(values) -> np.ndarray:
    x = np.asarray(values, dtype=float)
    if x.ndim != 1 or x.size < FEWEST_VALUES:
        raise ValueError(
            f"a series of shape {x.shape} has no interval; at least {FEWEST_VALUES} values"
        )
    if not np.isfinite(x).all():
        raise ValueError(f"value {int(np.flatnonzero(~np.isfinite(x))[0])} is not finite")
    return x


def _batch_means(x, length) -> tuple[np.ndarray, np.ndarray]:
    """Means (b,) of batches of a series (m,), and their centres (b,) from 0 (first value) to 1."""
    batches = int(np.clip(x.size / (BATCH_LENGTH * length), FEWEST_BATCHES, MOST_BATCHES))
    size = x.size // batches
    left = x.size - batches * size
    centres = (left + size * np.arange(batches) + (size - 1) / 2) / (x.size - 1)
    return x[left:].reshape(batches, size).mean(axis=1), centres
