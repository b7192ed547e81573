"""The mesh study: known errors and orders, and the grid convergence index's own worked example."""

import numpy as np
import pytest

from dustfall.benchmarks.mesh_study import (
    PAPER_FORMULATION,
    convergence_table,
    grid_convergence,
    mesh_study,
)
from dustfall.stokes.elements.boundary_elements import SCHEMES

FLAT, PROJECTED, LINEAR, QUADRATIC = SCHEMES


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


@pytest.fixture(scope="module")
def study():
    return mesh_study([0.7, 0.5, 0.35])


def test_each_scheme_has_its_known_error_on_an_isolated_sphere(study):
    error = study.pivot(index="size", columns="scheme", values="force").sort_index() / 24.0 - 1.0
    # Geometry: flat elements lose area, second order in their size.
    assert -0.02 > error.loc[0.5, FLAT] > -0.04
    # Projection alone takes it down by two orders of magnitude, Galerkin by more.
    for scheme in (PROJECTED, LINEAR, QUADRATIC):
        assert np.all(np.abs(error[scheme]) < 0.02 * np.abs(error[FLAT]))
    assert abs(error.loc[0.5, QUADRATIC]) < 1e-6


def test_the_share_tells_the_nodes_of_the_particle_from_those_of_the_outer_sphere(study):
    nodes, share = (study.pivot(index="size", columns="scheme", values=v) for v in
                    ("nodes", "share"))  # fmt: skip
    np.testing.assert_allclose(share[PAPER_FORMULATION], nodes[FLAT] / nodes[PAPER_FORMULATION])
    assert (share[FLAT] == 1).all()


def test_paper_formulation_is_the_flat_scheme_and_a_wall(study):
    force = study.pivot(index="size", columns="scheme", values="force")
    limit = study.groupby("scheme")["limit"].first()
    wall = limit[PAPER_FORMULATION] / 24.0 - 1.0
    assert wall == pytest.approx(2.25 / 1024, rel=3e-3)
    np.testing.assert_allclose(force[PAPER_FORMULATION] / force[FLAT] - 1.0, wall, rtol=0.15)


def test_flat_schemes_extrapolate_to_their_limits(study):
    table = convergence_table(study).set_index("scheme")
    assert len(table) == len(SCHEMES) + 1
    limit = study.groupby("scheme")["limit"].first()
    for scheme in (FLAT, PAPER_FORMULATION):
        assert 1.5 < table.loc[scheme, "order"] < 2.5
        assert table.loc[scheme, "extrapolated"] == pytest.approx(limit[scheme], abs=0.3)


def test_galerkin_schemes_leave_out_the_finest_meshes(monkeypatch):
    monkeypatch.setattr("dustfall.benchmarks.mesh_study.GALERKIN_DOWN_TO", 0.9)
    counted = mesh_study([1.0, 0.8]).groupby("scheme").size()
    assert counted[[LINEAR, QUADRATIC]].tolist() == [1, 1]
    assert counted[[FLAT, PROJECTED, PAPER_FORMULATION]].tolist() == [2, 2, 2]
