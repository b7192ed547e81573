"""Tests between numbers of particles: right error rate, and they do find a difference."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dustfall.analysis.independence import holm, independence_of_n, welch_anova


def steady(values, errors, quantity="settling_velocity_mean", runs=1, phi=1e-3):
    return pd.DataFrame(
        {
            "quantity": quantity,
            "model": "idnn",
            "n": [1000, 10000, 33000][: len(values)],
            "volume_fraction": phi,
            "galileo": 0.078,
            "value": values,
            "standard_error": errors,
            "degrees_of_freedom": 10.0,
            "runs": runs,
        }
    )


def test_two_means_give_welchs_t_test():
    rng = np.random.default_rng(1)
    a, b = rng.normal(0, 1, 8), rng.normal(0.7, 3, 20)
    f, _, freedom, p = welch_anova(
        [a.mean(), b.mean()], [stats.sem(a), stats.sem(b)], [len(a) - 1, len(b) - 1]
    )
    t = stats.ttest_ind(a, b, equal_var=False)
    assert f == pytest.approx(t.statistic**2)
    assert freedom == pytest.approx(t.df)
    assert p == pytest.approx(t.pvalue)


def test_equal_means_with_unequal_errors_are_refused_as_rarely_as_the_p_value_says():
    rng = np.random.default_rng(2)
    spread = np.array([3.0, 1.0, 0.5])
    found = []
    for _ in range(1000):
        runs = rng.normal(1.4, spread, (6, 3))
        error = runs.std(axis=0, ddof=1) / np.sqrt(6)
        found.append(welch_anova(runs.mean(axis=0), error, [5, 5, 5])[-1])
    assert np.mean(np.array(found) < 0.05) == pytest.approx(0.05, abs=0.02)


def test_a_difference_between_n_is_found_and_agreement_stands():
    agree = steady([1.500, 1.497, 1.4965], [7e-3, 2e-3, 1e-3])
    differ = steady([1.40, 1.497, 1.4965], [7e-3, 2e-3, 1e-3], phi=1e-4)
    table = independence_of_n(pd.concat([agree, differ])).set_index("volume_fraction")
    assert table.loc[1e-3, "p_adjusted"] > 0.5
    assert table.loc[1e-4, "p_adjusted"] < 1e-3
    assert table.loc[1e-4, ["numbers", "smallest", "largest"]].tolist() == [3, 1.40, 1.497]


def test_averages_that_know_nothing_of_another_start_are_left_out():
    one = steady([0.03, 0.04], [1e-4, 1e-4], "settling_velocity_variance", runs=1)
    three = steady([0.03, 0.04], [1e-4, 1e-4], "settling_velocity_variance", runs=3, phi=1e-4)
    alone = steady([1.4], [1e-3])
    table = independence_of_n(pd.concat([one, three, alone]))
    assert table["volume_fraction"].tolist() == [1e-4]
    assert independence_of_n(alone).empty


def test_holm_corrects_step_by_step():
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])
    np.testing.assert_allclose(holm([0.9, 0.8]), [1, 1])
    with pytest.raises(ValueError, match="above zero"):
        welch_anova([1, 2], [0.1, 0], [3, 3])
    with pytest.raises(ValueError, match="at least 2"):
        welch_anova([1], [0.1], [3])
