"""Estimates of moving spheres held against an independent method: what counts, and a pair."""

import pandas as pd
import pytest

from dustfall.benchmarks.moving_estimates import cost, coverage, judged


def test_coverage_counts_loads_that_the_reference_knows_and_no_others():
    columns = ["cluster", "spheres", "tolerance", "error", "estimate", "status", "reference"]
    rows = [
        (0, 2, 1e-2, 9e-3, 9.5e-3, "converged", 1e-3),
        (0, 2, 1e-2, 9e-3, 5e-3, "converged", 1e-3),  # within, not covered
        (1, 2, 1e-2, 2e-2, 3e-2, "out of reach", 1e-3),  # covered, and never said to be within
        (1, 2, 1e-2, 9e-1, 1e-3, "converged", 4e-3),  # not known well enough
    ]
    found = coverage(pd.DataFrame(rows, columns=columns)).iloc[0]
    assert (found["loads"], found["known"]) == (4, 3)
    assert found["converged"] == pytest.approx(2 / 3)
    assert found["within"] == 1.0
    assert found["covered"] == pytest.approx(2 / 3)


def test_the_loads_of_a_small_cluster_are_known_and_covered():
    found = coverage(judged(1, tolerances=(1e-2,), seed=11))
    assert (found["loads"] == found["known"]).all()
    assert (found[["converged", "within", "covered"]] == 1.0).all(axis=None)


def test_what_a_cloud_costs_is_told_for_each_number_and_volume_fraction():
    table = cost([5, 9], (0.01, 0.05), tolerance=1e-2)
    assert table["spheres"].tolist() == [5, 9, 5, 9]
    assert set(table["status"]) == {"converged"}
    assert (table["error_estimate"] <= 1e-2).all()
    assert (table["seconds"] > 0.0).all()
    assert (table["memory"] > 0.0).all()
