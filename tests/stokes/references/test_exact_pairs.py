"""Two fixed spheres: the exact series at every gap, near contact, far away and in between."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_banded

from dustfall.stokes.references.exact_pairs import SMALLEST_GAP, forces_on_two_spheres, pair_drag

# Drag over the isolated drag at s radii, along and across (Stimson and Jeffery 1926; Jeffrey and
# Onishi 1984), to all twelve digits.
TABLE = {
    2.01: (0.645722078469, 0.725521742586),
    2.1: (0.650900144515, 0.733131015965),
    2.5: (0.672915513765, 0.763785774824),
    3.0: (0.698304560250, 0.794925895255),
    5.0: (0.777239786668, 0.867501587313),
    10.0: (0.870600502898, 0.929865830469),
    20.0: (0.930360936289, 0.963801731055),
}


@pytest.mark.parametrize("s", TABLE)
def test_known_digits_all_hold(s):
    assert pair_drag(s / 2.0) == pytest.approx(TABLE[s], abs=6e-13)


def test_many_distances_at_once_give_what_each_gives():
    s = np.array(list(TABLE))
    along, across = pair_drag(s.reshape(1, -1) / 2.0)
    assert along.shape == across.shape == (1, len(s))
    np.testing.assert_allclose(np.stack([along[0], across[0]], 1), list(TABLE.values()), rtol=1e-12)


def touching_along():
    """The series of Stimson and Jeffery as the integral that it is at contact."""

    def density(x):
        return (1.0 - np.exp(-x) + x + 0.5 * x * x) / (np.sinh(x) + x)

    return quad(density, 0.0, 100.0, epsabs=1e-13, epsrel=1e-13, limit=200)[0] / 6.0


def test_touching_spheres_feel_the_limit():
    along, across = pair_drag(1.0)
    assert along == pytest.approx(0.645141425513, abs=6e-13)
    assert along == pytest.approx(touching_along(), rel=1e-12)
    # Jeffrey and Onishi 1984, the constants of their lubrication formulas: 0.9983 - 0.2737.
    assert across == pytest.approx(0.7246, abs=1e-4)


def test_far_spheres_feel_the_reflections():
    """Jeffrey and Onishi 1984, their polynomials f_k for equal spheres, up to s^-6."""
    distance = np.array([50.0, 300.0, 1e4, 1e5, 1e8])
    t = -0.25 / distance  # -1 / (2 s)
    along = np.polynomial.polynomial.polyval(t, [1, 3, 9, 19, 93, 387, 1197])
    across = np.polynomial.polynomial.polyval(
        t, [1, 3 / 2, 9 / 4, 59 / 8, 465 / 16, 2259 / 32, 14745 / 64]
    )
    left_out = 6e3 * np.abs(t) ** 7 + 1e-15
    assert (np.abs(pair_drag(distance) - np.stack([along, across])) < left_out).all()


def across_from_unsimplified_recurrences(distance):
    """No slip and div u = 0 as they stand (Dean and O'Neill 1963); drag from the pressure.

    B, D and F are the coefficients of Q, U0 and U2, all as linear forms in the a_n of W.
    """
    alpha = np.arccosh(distance)
    last = int(60.0 / alpha) + 20
    n = np.arange(last + 2)
    k = n + 0.5
    ch, sh = np.cosh(alpha), np.sinh(alpha)
    c, s = np.cosh(k * alpha), np.sinh(k * alpha)
    delta = 2.0 * np.sqrt(2.0) * np.exp(-k * alpha)

    def b(j):  # coefficients of a_(j-1), a_j, a_(j+1)
        return -2.0 / sh * np.array([-(j - 1) / (2 * j - 1), ch + 0 * j, -(j + 2) / (2 * j + 3)])

    def d(j):
        return np.array([-(j - 1) * j / (2 * j - 1), 0 * j, (j + 1) * (j + 2) / (2 * j + 3)]) / sh

    def f(j):
        return np.array([1 / (2 * j - 1), 0 * j, -1 / (2 * j + 3)]) / sh

    m = n[1:-1]
    below = (-(m - 1) * b(m - 1) - d(m - 1) + (m - 2) * (m - 1) * f(m - 1)) / c[m - 1]
    own = (5 * b(m) + 2 * d(m) - 2 * (m - 1) * (m + 2) * f(m)) / c[m]
    above = ((m + 2) * b(m + 1) - d(m + 1) + (m + 2) * (m + 3) * f(m + 1)) / c[m + 1]
    band = np.zeros((3, len(m)))
    band[1] = below[2] + own[1] + above[0] + 2 * (2 * m + 1) / s[m]
    band[0, 1:] = (own[2] + above[1] - 2 * (m + 2) / s[m + 1])[:-1]
    band[2, :-1] = (below[1] + own[0] - 2 * (m - 1) / s[m - 1])[1:]
    right = delta[m - 1] / c[m - 1] - 2 * delta[m] / c[m] + delta[m + 1] / c[m + 1]
    a = np.pad(solve_banded((1, 1), band, right), (1, 1))
    pressure = (b(m) * np.stack([a[:-2], a[1:-1], a[2:]])).sum(axis=0) / c[m]
    return np.sqrt(2.0) / 3.0 * sh * (m * (m + 1) * pressure).sum()


@pytest.mark.parametrize("distance", [1.0005, 1.005, 1.1, 1.7, 4.0])
def test_across_solves_the_equations_it_was_simplified_from(distance):
    assert pair_drag(distance)[1] == pytest.approx(
        across_from_unsimplified_recurrences(distance), rel=1e-10
    )


def test_drag_is_smooth_where_the_series_hands_over_to_its_tangent():
    gap = SMALLEST_GAP * np.linspace(0.0, 4.0, 9)
    for drag in pair_drag(1.0 + gap):
        np.testing.assert_allclose(np.diff(drag), np.diff(drag).mean(), rtol=1e-4)


def test_drag_grows_with_distance_at_every_scale():
    distance = 1.0 + np.geomspace(1e-9, 1e5, 400)
    along, across = pair_drag(distance)
    assert (np.diff(along) > 0.0).all()
    assert (np.diff(across) > 0.0).all()
    assert (along < across).all()
    assert (across < 1.0).all()


def test_force_follows_flow_and_line_of_centres():
    along, across = pair_drag(1.3)
    line = np.array([2.0, 3.0, 6.0]) / 7.0
    normal = np.array([3.0, -2.0, 0.0]) / np.sqrt(13.0)
    centres = np.array([[5.0, -1.0, 0.5], [5.0, -1.0, 0.5] + 1.3 * line])
    force = forces_on_two_spheres(centres, 3.0 * line + 4.0 * normal)
    expected = 24.0 * (0.6 * along * line + 0.8 * across * normal)
    np.testing.assert_allclose(force, [expected, expected], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(forces_on_two_spheres(centres, np.zeros(3)), np.zeros((2, 3)))


@pytest.mark.parametrize("distance", [0.999, np.nan, np.inf, [2.0, -3.0]])
def test_distances_that_mean_nothing_are_refused(distance):
    with pytest.raises(ValueError, match="finite and at least 1 d_p"):
        pair_drag(distance)


def test_bad_scenes_are_refused():
    with pytest.raises(ValueError, match="shape"):
        forces_on_two_spheres(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="three finite numbers"):
        forces_on_two_spheres([[0, 0, 0], [0, 0, 2]], [0.0, np.nan, 0.0])
    with pytest.raises(ValueError, match="at least 1 d_p"):
        forces_on_two_spheres([[0, 0, 0], [0, 0, 0.5]])
