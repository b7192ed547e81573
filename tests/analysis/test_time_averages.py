"""Means of correlated series with honest intervals, and drifts that are no chance."""

import numpy as np
import pytest

from dustfall.analysis.time_averages import (
    correlation_length,
    drift,
    drift_of_runs,
    mean_with_interval,
)
from tests.analysis.series import autoregressive


def test_correlation_length_of_an_autoregressive_series():
    a = np.exp(-1 / 10)
    series = autoregressive(np.random.default_rng(1), 200_000, 10)
    assert correlation_length(series) == pytest.approx((1 + a) / (1 - a), rel=0.05)
    assert correlation_length(np.random.default_rng(2).normal(size=10_000)) < 1.2
    assert correlation_length(np.ones(50)) == 1


@pytest.mark.parametrize("memory", [1e-3, 20.0])
def test_intervals_hold_the_true_mean_as_often_as_they_say(memory):
    rng = np.random.default_rng(int(memory) + 1)
    held = 0
    for _ in range(400):
        mean = mean_with_interval(autoregressive(rng, 2000, memory))
        held += abs(mean.value) < mean.half_width
    assert 0.91 < held / 400 < 0.98


def test_a_series_taken_for_independent_would_have_too_narrow_an_interval():
    series = autoregressive(np.random.default_rng(5), 2000, 20)
    assert mean_with_interval(series).standard_error > 3 * series.std() / np.sqrt(2000)


@pytest.mark.parametrize("memory", [1e-3, 20.0])
def test_a_series_without_drift_is_taken_for_drifting_as_rarely_as_the_p_value_says(memory):
    rng = np.random.default_rng(int(memory) + 7)
    found = [drift(autoregressive(rng, 1000, memory)).p_value for _ in range(400)]
    assert 0.02 < np.mean(np.array(found) < 0.05) < 0.10


def test_a_drift_is_found_with_its_size_and_end_under_correlated_noise():
    rng = np.random.default_rng(11)
    found = [drift(np.linspace(0, 3, 2000) + autoregressive(rng, 2000, 10)) for _ in range(50)]
    change = np.array([d.change for d in found])
    assert change.mean() == pytest.approx(3, abs=3 * change.std() / np.sqrt(50))
    assert np.mean([d.end for d in found]) == pytest.approx(3, abs=0.15)
    assert np.mean([d.standard_error for d in found]) == pytest.approx(change.std(), rel=0.25)
    assert np.mean([d.p_value < 0.05 for d in found]) > 0.95
    together = drift_of_runs(found)
    assert together.standard_error == pytest.approx(change.std() / np.sqrt(50), rel=0.3)


def test_a_straight_line_drifts_for_certain_and_a_constant_or_its_rounding_does_not():
    line = drift(np.linspace(1, 2, 40))
    assert (line.change, line.end) == pytest.approx((1, 2))
    assert line.p_value < 1e-10
    constant = drift(np.full(40, 1.4))
    assert (constant.change, constant.end, constant.p_value) == pytest.approx((0, 1.4, 1))
    assert drift(np.linspace(1, 1 + 1e-8, 40)).p_value == 1


def test_series_without_an_interval_are_refused():
    with pytest.raises(ValueError, match="at least 10 values"):
        drift(np.ones(9))
    with pytest.raises(ValueError, match="value 3 is not finite"):
        mean_with_interval(np.array([1, 2, 3, np.nan] * 4))
