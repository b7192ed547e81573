"""A lone sphere answers as the exact solutions say."""

import numpy as np
import pytest

from dustfall.stokes.harmonics import real_harmonics
from dustfall.stokes.many_body import FORCE_UNIT, TEMPLATE_SIZES, template_body
from dustfall.stokes.one_body import OneBody
from dustfall.stokes.quadrature import sphere_rule

STRAIN = np.array([[1.0, 0.3, 0.2], [0.3, -0.4, 0.5], [0.2, 0.5, -0.6]])
SPIN = np.array([0.3, -1.0, 0.5])

# Traction on a sphere of radius a held in a flow, mu = 1 (Kim and Karrila 1991, chapter 3).
EXACT = {
    "translation": (lambda n: np.tile([0.2, 1.0, -0.4], (len(n), 1)), lambda n, u: 3.0 * u),
    "rotation": (lambda n: 0.5 * np.cross(SPIN, n), lambda n, u: 6.0 * u),
    "straining": (lambda n: 0.5 * n @ STRAIN, lambda n, u: 10.0 * u),
}


@pytest.fixture(scope="module", params=TEMPLATE_SIZES)
def body(request):
    return template_body(request.param)


# Largest relative error of the moments, for the edge lengths of the templates.
BOUNDS = {0.7: 2e-3, 0.5: 3e-4, 0.35: 1e-4}


@pytest.mark.parametrize("flow", EXACT)
def test_traction_moments_are_exact(body, flow):
    size = {len(template_body(s).factor): s for s in TEMPLATE_SIZES}[len(body.factor)]
    incoming, traction = EXACT[flow]
    points, weights = sphere_rule(9)
    harmonics = real_harmonics(2, points)
    velocity = incoming(points)
    seen = harmonics.T @ (weights[:, None] * velocity)
    expected = 0.25 * harmonics.T @ (weights[:, None] * traction(points, velocity))
    moments = (body.response[:27, :27] @ seen.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(moments, expected, atol=BOUNDS[size] * np.abs(expected).max())


def test_drag_converges_to_stokes_drag():
    errors = [abs(FORCE_UNIT * template_body(size).drag() / 24.0 - 1.0) for size in TEMPLATE_SIZES]
    assert errors[0] < 2e-5
    assert errors[1] < 2e-6
    assert errors[2] < 1e-7
    assert len(template_body(TEMPLATE_SIZES[2]).mesh.triangles) <= 320


def test_response_is_symmetric_and_dissipates(body):
    response = body.response[: 3 * 36, : 3 * 36]
    np.testing.assert_allclose(response, response.T, atol=1e-12 * np.abs(response).max())
    assert np.linalg.eigvalsh(response).min() > -1e-10 * np.abs(response).max()


def test_a_pressure_inside_exerts_no_force(body):
    """A flow along the normal, which no incompressible flow has, drives nothing else."""
    points, weights = sphere_rule(9)
    normal = real_harmonics(2, points).T @ (weights[:, None] * points)
    moments = (body.response[:27, :27] @ normal.ravel()).reshape(-1, 3)
    assert np.abs(moments[0]).max() < 1e-3 * np.abs(moments).max()


def test_saved_operator_comes_back_bit_for_bit(body, tmp_path):
    body.save(tmp_path / "body.h5")
    again = OneBody.load(tmp_path / "body.h5")
    for name in ("factor", "moments", "response"):
        np.testing.assert_array_equal(getattr(again, name), getattr(body, name))
    np.testing.assert_array_equal(again.mesh.triangles, body.mesh.triangles)
