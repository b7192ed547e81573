"""The paper's formulation: wall effect, limit of free space, and frames of reference."""

import numpy as np
import pytest

from dustfall.stokes.elements.boundary_elements import SCHEMES, forces_by_elements
from dustfall.stokes.elements.mesh import sphere_mesh
from dustfall.stokes.elements.outer_sphere import exact_drag_in_outer_sphere, forces_in_outer_sphere

FLAT = next(iter(SCHEMES))
ORIGIN = np.zeros((1, 3))
CLUSTER = np.array([[0.0, 0.0, 0.0], [1.3, 0.0, 0.0], [0.0, 0.2, 1.5]])


@pytest.fixture(scope="module")
def mesh():
    return sphere_mesh(0.5)


@pytest.mark.parametrize("ratio", [2.0, 5.0, 10.0, 1024.0])
def test_drag_in_a_concentric_sphere_converges_to_the_exact_one(ratio):
    errors = []
    for size in (0.7, 0.35):
        mesh = sphere_mesh(size)
        force = forces_in_outer_sphere(ORIGIN, mesh, mesh, ratio=ratio)[0, 1]
        errors.append(1.0 - force / exact_drag_in_outer_sphere(ratio))
    assert 0.0 < errors[1] < 0.03
    # Flat elements: second order.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.35)


def test_wall_effect_fades_as_the_inverse_ratio(mesh):
    free = forces_by_elements(CLUSTER, mesh, FLAT)
    walls = [
        np.abs(forces_in_outer_sphere(CLUSTER, mesh, mesh, ratio=r, tolerance=1e-7) - free).max()
        for r in (100.0, 1000.0)
    ]
    assert walls[0] / walls[1] == pytest.approx(10.0, rel=0.05)
    assert walls[1] < 0.03


def test_no_force_where_all_moves_alike(mesh):
    """The double layer over the particles carries this one."""
    flow = np.array([0.0, 1.0, 0.0])
    force = forces_in_outer_sphere(
        CLUSTER, mesh, mesh, flow, ratio=3.0, velocities=np.tile(flow, (3, 1)), tolerance=1e-7
    )
    np.testing.assert_allclose(force, 0.0, atol=1e-5)


def test_only_relative_velocity_matters(mesh):
    flow, drift = np.array([0.0, 1.0, 0.0]), np.array([0.4, 0.0, -0.3])
    still = forces_in_outer_sphere(CLUSTER, mesh, mesh, flow, ratio=3.0, tolerance=1e-7)
    moving = forces_in_outer_sphere(
        CLUSTER, mesh, mesh, flow + drift, 3.0, np.tile(drift, (3, 1)), tolerance=1e-7
    )
    # Forces are made dimensionless by the velocity of the outer sphere.
    np.testing.assert_allclose(moving * np.linalg.norm(flow + drift), still, atol=1e-4)


def test_bad_input_is_named(mesh):
    with pytest.raises(ValueError, match=r"ratio 1\.0"):
        forces_in_outer_sphere(ORIGIN, mesh, mesh, ratio=1.0)
    with pytest.raises(ValueError, match="flow must not be zero"):
        forces_in_outer_sphere(ORIGIN, mesh, mesh, flow=(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"shape \(3, 3\)"):
        forces_in_outer_sphere(CLUSTER, mesh, mesh, velocities=[0.0, 1.0, 0.0])
    with pytest.raises(ValueError, match="overlap"):
        forces_in_outer_sphere(0.5 * CLUSTER, mesh, mesh)
