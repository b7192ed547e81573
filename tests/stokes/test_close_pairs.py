"""Degrees eliminated from a pair leave what they would have done, however many they are."""

import numpy as np
import pytest

from dustfall.stokes import close_pairs
from dustfall.stokes.close_pairs import effective_coupling
from dustfall.stokes.harmonics import exact_response
from dustfall.stokes.multipoles import (
    NO_CLOSE_PAIRS,
    add_responses,
    couple_scene,
    solve_system,
)
from dustfall.stokes.solve import response_rows
from dustfall.stokes.translation import block_size, translation_tables

LOW = 2


def moments(radii, distance, degree, effective=None):
    """Moments up to LOW of two spheres that exchange `degree`, in a random flow of degrees to LOW.

    The second sphere is at the origin; effective: the coupling of the pair, if it is a close one.
    """
    rng, tables = np.random.default_rng(5), translation_tables()
    response = response_rows(exact_response(40))
    centres = np.array([np.zeros(3), distance * np.array([0.48, -0.6, 0.64])])
    degrees = np.array([[0, degree], [degree, 0]])
    close = NO_CLOSE_PAIRS if effective is None else (degrees > 0, effective)
    scene = couple_scene(centres, np.array(radii[::-1]), degrees, 1, close, tables)
    flow = np.zeros((2, (degree + 1) ** 2, 3))
    flow[:, : (LOW + 1) ** 2] = rng.standard_normal((2, (LOW + 1) ** 2, 3))
    right = np.zeros((flow.size // 3, 3))
    add_responses(flow.reshape(-1, 3), scene, response, right)
    found, _, _ = solve_system(right, np.zeros_like(right), scene, response, tables, 1e-13, 600)
    return found.reshape(2, -1, 3)[:, : (LOW + 1) ** 2]


@pytest.mark.parametrize(("radii", "distance"), [((1.0, 1.0), 2.2), ((0.3, 1.0), 1.5)])
def test_eliminated_degrees_act_as_those_that_are_solved_for(radii, distance):
    effective = effective_coupling(LOW, (30, 30), radii, distance)
    found = moments(radii, distance, LOW, effective)
    expected = moments(radii, distance, 30)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_polynomials_between_degrees_change_nothing(monkeypatch):
    """At a gap of 1e-3 radii, 500 degrees."""
    scene = LOW, (500, 300), (1.0, 0.7), 1.701
    few = moments(*scene[2:], LOW, effective_coupling(*scene))
    monkeypatch.setattr(close_pairs, "FIRST_SPAN", 1000)
    every = moments(*scene[2:], LOW, effective_coupling(*scene))
    assert np.abs(every).max() > 100.0
    np.testing.assert_allclose(few, every, rtol=0, atol=1e-8 * np.abs(every).max())


def test_effective_coupling_is_symmetric_and_gains_nothing_on_a_sphere():
    """What comes back from the other sphere weakens a sphere's own single layer, never its sign."""
    effective = effective_coupling(LOW, (200, 200), (1.0, 1.0), 2.01)
    begin = 0
    for total in range(LOW + 2):
        size = block_size(LOW, total)
        matrix = effective[begin : begin + 4 * size**2].reshape(2 * size, 2 * size)
        begin += 4 * size**2
        np.testing.assert_array_equal(matrix, matrix.T)
        for own in (matrix[:size, :size], matrix[size:, size:]):
            assert np.linalg.eigvalsh(own).max() < 1e-12
    assert begin == len(effective)
