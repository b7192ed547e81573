"""A meshed sphere answers as the spectrum of the single layer on a sphere says."""

import numpy as np
import pytest

from dustfall.stokes.elements.mesh import sphere_mesh
from dustfall.stokes.elements.one_body import RESPONSE_DEGREE, OneBody
from dustfall.stokes.harmonics import single_layer_spectrum
from dustfall.units import FORCE_UNIT

SIZES = (0.7, 0.5, 0.35)
SPECTRUM = single_layer_spectrum(RESPONSE_DEGREE)


@pytest.fixture(scope="module")
def bodies():
    return [OneBody.from_mesh(sphere_mesh(size)) for size in SIZES]


def deviation(body):
    """Largest relative error of the answer at each degree, (degree + 1,)."""
    return np.abs(body.response * SPECTRUM - (SPECTRUM > 0.0)).max(axis=1)


def test_answer_converges_to_the_spectrum_at_every_degree(bodies):
    coarse, middle, fine = (deviation(body) for body in bodies)
    assert fine[0] < 1e-8
    assert fine[1] < 5e-8
    assert fine[2] < 2e-6
    assert fine[-1] < 5e-3
    # Quadratic Galerkin: errors fall with the fourth power of the edge length or faster.
    for rough, smooth, ratio in ((coarse, middle, 0.7 / 0.5), (middle, fine, 0.5 / 0.35)):
        observed = np.log(rough[1:7] / smooth[1:7]) / np.log(ratio)
        assert observed.min() > 3.0
        assert np.median(observed) > 4.0


def test_drag_converges_to_stokes_drag(bodies):
    errors = [abs(FORCE_UNIT * body.drag() / 24.0 - 1.0) for body in bodies]
    assert errors[0] < 2e-6
    assert errors[1] < 1e-7
    assert errors[2] < 1e-8
    assert len(bodies[2].mesh.triangles) <= 320
