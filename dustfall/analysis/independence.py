"""Do the statistics depend on the number of particles?"""

import numpy as np
import pandas as pd
import scipy

from dustfall.analysis.settling import PARTICLE_MEANS
from dustfall.analysis.time_averages import FEWEST_SEEDS


def welch_anova(means, errors, freedoms) -> tuple[float, float, float, float]:
    """Test whether means with unequal errors can be one and the same (Welch 1951, Biometrika 38).

    Parameters: `means`, their standard `errors` and the `freedoms`, degrees of freedom behind each
    error, all (k,) with k >= 2. Returns the statistic F, its two degrees of freedom and the
    probability of an F at least as large among equal means.

    Raises ValueError for fewer than two means or an error that is not above zero.
    """
    means, errors, freedoms = (np.asarray(v, dtype=float) for v in (means, errors, freedoms))
    k = len(means)
    if k < 2:
        raise ValueError(f"{k} means cannot be compared; at least 2 are needed")
    if not (errors > 0).all():
        raise ValueError(f"the standard errors are {errors.tolist()}; each must be above zero")
    weight = 1 / errors**2
    share = weight / weight.sum()
    scatter = np.sum(weight * (means - np.sum(share * means)) ** 2) / (k - 1)
    uncertain = np.sum((1 - share) ** 2 / freedoms)
    statistic = scatter / (1 + 2 * (k - 2) / (k**2 - 1) * uncertain)
    second = (k**2 - 1) / (3 * uncertain)
    return float(statistic), k - 1, float(second), float(scipy.stats.f.sf(statistic, k - 1, second))


def independence_of_n(steady: pd.DataFrame) -> pd.DataFrame:
    """Test for each case whether its steady-state averages are the same for every n.

    Parameters: `steady` as `analysis.settling.steady_state` returns it, several quantities one
    below the other. Cases with one n are left out, and averages whose error tells nothing of
    another random start: those that are no mean over particles and of fewer than three seeds.

    Returns the columns quantity, model, volume_fraction, galileo, numbers (of n), smallest, largest
    (of the averages), f, freedom, error_freedom, p_value, and p_adjusted, the p-value after Holm's
    (1979) correction for the number of tests in the table. Independence stands where p_adjusted is
    not small.
    """
    rows = []
    cases = ["quantity", "model", "volume_fraction", "galileo"]
    sound = steady["quantity"].isin(PARTICLE_MEANS) | (steady["runs"] >= FEWEST_SEEDS)
    for case, group in steady[sound & (steady["standard_error"] > 0)].groupby(cases):
        if group["n"].nunique() < 2:
            continue
        found = welch_anova(group["value"], group["standard_error"], group["degrees_of_freedom"])
        names = ("f", "freedom", "error_freedom", "p_value")
        rows.append(
            dict(zip(cases, case, strict=True))
            | {
                "numbers": group["n"].nunique(),
                "smallest": group["value"].min(),
                "largest": group["value"].max(),
            }
            | dict(zip(names, found, strict=True))
        )
    columns = [*cases, "numbers", "smallest", "largest", "f", "freedom", "error_freedom", "p_value"]
    table = pd.DataFrame(rows, columns=columns)
    return table.assign(p_adjusted=holm(table["p_value"]))


def holm(p_values) -> np.ndarray:
    """Holm's (1979) step-down correction of p-values (m,) for m tests."""
    p = np.asarray(p_values, dtype=float)
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p)))), 1)
    return adjusted
