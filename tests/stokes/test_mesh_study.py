"""The mesh study: known errors and orders, and the grid convergence index's own worked example."""

import numpy as np
import pytest

from dustfall.stokes.mesh_study import convergence_table, grid_convergence, mesh_study


def test_worked_example_of_celik_2008():
    """Table 1 there, reattachment length: 18000, 8000 and 4500 cells in two dimensions."""
    h = np.array([18000, 8000, 4500]) ** -0.5
    index = grid_convergence(h, [6.063, 5.972, 5.863])
    assert index["order"] == pytest.approx(1.53, abs=0.01)
    assert index["extrapolated"] == pytest.approx(6.1685, abs=1e-3)
    assert index["approximate_error"] == pytest.approx(0.015, abs=5e-4)
    assert index["extrapolated_error"] == pytest.approx(0.017, abs=5e-4)
    assert index["gci"] == pytest.approx(0.022, abs=5e-4)


@pytest.mark.parametrize("order", [1.0, 2.0, 5.0])
def test_exact_power_law_is_recovered(order):
    h = np.array([0.1, 0.17, 0.3])
    index = grid_convergence(h, 24.0 - 3.0 * h**order)
    assert index["order"] == pytest.approx(order, rel=1e-6)
    assert index["extrapolated"] == pytest.approx(24.0, rel=1e-8)


def test_no_order_where_there_is_none():
    assert np.isnan(grid_convergence([0.1, 0.2, 0.3], [1.0, 1.0, 2.0])["order"])
    with pytest.raises(ValueError, match="finest first"):
        grid_convergence([0.3, 0.2, 0.1], [1.0, 2.0, 3.0])


def test_each_scheme_has_its_known_error_on_an_isolated_sphere():
    study = mesh_study([0.7, 0.5, 0.35])
    error = study.pivot(index="size", columns="scheme", values="force").sort_index() / 24.0 - 1.0
    flat = error["constant, flat elements"]
    projected = error["constant, projected elements"]
    galerkin = error["quadratic Galerkin, projected elements"]
    # Geometry: flat elements lose area, second order in their size.
    assert -0.015 > flat[0.35] > -0.04
    assert flat[0.7] / flat[0.35] == pytest.approx(4.0, rel=0.3)
    # Projection alone takes it down by two orders of magnitude, quadratic Galerkin by two more.
    assert np.all(np.abs(projected) < 0.02 * np.abs(flat))
    assert np.all(np.abs(galerkin) < 0.02 * np.abs(flat))
    assert abs(galerkin[0.35]) < 1e-7
    table = convergence_table(study).set_index("scheme")
    assert 1.5 < table.loc["constant, flat elements", "order"] < 2.5
    assert table.loc["constant, flat elements", "extrapolated"] == pytest.approx(24.0, abs=0.15)
