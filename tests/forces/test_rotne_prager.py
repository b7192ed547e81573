import numpy as np
import pytest

from dustfall.forces import IsolatedStokes, RotnePrager, Stokeslets, rotne_prager_forces
from tests.forces.scenes import random_neighbours

# Exact force / isolated Stokes drag of two fixed equal spheres at s = 20 radii
# (Stimson & Jeffery 1926; Jeffrey & Onishi 1984).
ALONG, ACROSS = 0.930360936289, 0.963801731055


@pytest.mark.parametrize(
    ("second", "ratio"), [([0, 10, 0], ALONG), ([10, 0, 0], ACROSS), ([0, 0, 10], ACROSS)]
)
def test_two_distant_spheres_have_the_exact_force(second, ratio):
    forces = rotne_prager_forces([[0, 0, 0], second])
    np.testing.assert_allclose(forces[:, 1], 24 * ratio, rtol=1e-4)
    np.testing.assert_allclose(forces[:, [0, 2]], 0, atol=1e-13)


def test_two_spheres_have_the_inverse_of_their_two_mobilities():
    # On the axis the 2x2 mobility has eigenvalue 1 + 3/(2 s) - 1/s^3, with s in radii.
    s = 4.0
    force = rotne_prager_forces([[0, 0, 0], [0, s / 2, 0]])[0, 1]
    np.testing.assert_allclose(force, 24 / (1 + 1.5 / s - 1 / s**3), rtol=1e-14)


def test_an_isolated_sphere_has_stokes_drag_in_any_flow():
    np.testing.assert_allclose(
        rotne_prager_forces([[3, 1, 2]], flow=(1, 2, -2)), [[8, 16, -16]], rtol=1e-15
    )
    np.testing.assert_array_equal(IsolatedStokes().predict(random_neighbours(3)), [[0, 24, 0]] * 3)


def test_batched_forces_equal_the_plain_solve():
    neighbours = random_neighbours(130, nearest=1.0, farthest=20.0)
    plain = [
        rotne_prager_forces(np.vstack([np.zeros(3), np.where(d < 1, x / d, x)]))[0]
        for x, d in zip(neighbours, np.linalg.norm(neighbours, axis=2, keepdims=True), strict=True)
    ]
    np.testing.assert_allclose(RotnePrager().predict(neighbours), plain, rtol=1e-11, atol=1e-11)


def test_order_of_neighbours_does_not_matter():
    neighbours = random_neighbours(40)
    expected = RotnePrager().predict(neighbours)
    np.testing.assert_array_equal(RotnePrager().predict(neighbours[:, [4, 2, 0, 1, 3]]), expected)


def test_force_goes_over_into_stokes_drag_far_away():
    neighbours = random_neighbours(40)
    for size in (1e4, 1e8, 1e12):
        deviation = RotnePrager().predict(size * neighbours) - [0, 24, 0]
        assert np.abs(deviation).max() < 100 / size


def test_neighbours_closer_than_contact_are_held_at_contact():
    neighbours = random_neighbours(20)
    neighbours[:, 2] /= np.linalg.norm(neighbours[:, 2], axis=1, keepdims=True)
    expected = RotnePrager().predict(neighbours)
    neighbours[:, 2] *= 0.3
    np.testing.assert_allclose(RotnePrager().predict(neighbours), expected, rtol=1e-12, atol=1e-12)


def test_overlapping_neighbours_keep_the_force_finite_and_below_stokes():
    neighbours = random_neighbours(50, farthest=9.0)
    neighbours[:, 1] = neighbours[:, 0]
    neighbours[:25, 1] += 0.2
    streamwise = RotnePrager().predict(neighbours)[:, 1]
    assert (streamwise < 24).all()
    assert (streamwise > 0).all()


def test_empty_batch_gives_no_forces():
    assert RotnePrager().predict(np.empty((0, 5, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("centres", "message"),
    [
        (np.zeros((2, 2)), "shape"),
        (np.zeros((0, 3)), "shape"),
        ([[0, 0, np.nan]], "finite"),
        (np.zeros((2, 3)), "spheres 0 and 1"),
    ],
)
def test_impossible_centres_are_refused(centres, message):
    with pytest.raises(ValueError, match=message):
        rotne_prager_forces(centres)


def test_stokeslets_superpose_the_first_order_of_each_pair():
    neighbours = 1e3 * random_neighbours(10)
    one = []
    for j in range(5):
        alone = 1e12 * np.ones((10, 5, 3)) * np.arange(1, 6)[:, None]
        alone[:, j] = neighbours[:, j]
        one.append(RotnePrager().predict(alone) - [0, 24, 0])
    difference = Stokeslets().predict(neighbours) - [0, 24, 0] - sum(one)
    distance = np.linalg.norm(neighbours, axis=2).min(axis=1)
    assert (np.abs(difference).max(axis=1) < 24 / distance**2).all()
