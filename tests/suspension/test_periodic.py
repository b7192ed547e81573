"""The periodic mobility agrees with theory: lattices, far images, splitting, positivity."""

import numpy as np
import pytest

from dustfall.sedimentation.start import random_positions
from dustfall.sedimentation.state import box_length
from dustfall.suspension.periodic import HASIMOTO, periodic_mobility
from dustfall.suspension.rotne_prager import rotne_prager_forces
from dustfall.units import RADIUS


@pytest.mark.parametrize("phi", [1e-3, 1e-2, 0.1])
def test_a_simple_cubic_lattice_settles_as_hasimoto_says(phi):
    side = (np.pi / 6 / phi) ** (1 / 3)
    mobility = periodic_mobility(np.zeros((1, 3)), side, tolerance=1e-9)
    # Exact for the Rotne-Prager tensor; phi comes from the quadrupoles of the images.
    expected = 1 - HASIMOTO * RADIUS / side + phi
    np.testing.assert_allclose(mobility, expected * np.eye(3), atol=1e-6)


def test_the_splitting_of_the_sum_changes_nothing():
    positions, side = random_positions(np.random.default_rng(1), 40, 1e-2), box_length(40, 1e-2)
    one, other = (
        periodic_mobility(positions, side, 1e-8, splitting / side) for splitting in (5.0, 11.0)
    )
    np.testing.assert_allclose(one, other, atol=1e-7)
    np.testing.assert_allclose(one, one.T, atol=1e-14)
    assert np.linalg.eigvalsh(one).min() > 0


def test_few_spheres_in_a_huge_cube_are_those_in_unbounded_fluid():
    centres = np.array([[0, 0, 0], [1.3, 0, 0], [0, 2.0, 1.0]])
    side = 4000.0
    mobility = periodic_mobility(centres, side, 1e-8)
    # The nearest images slow all spheres alike.
    mobility += HASIMOTO * RADIUS / side * np.kron(np.ones((3, 3)), np.eye(3))
    force = 24 * np.linalg.solve(mobility, np.tile([0.0, 1, 0], 3)).reshape(3, 3)
    np.testing.assert_allclose(force, rotne_prager_forces(centres), atol=1e-5)


def test_whole_sides_change_nothing_and_coincident_centres_are_refused():
    positions, side = random_positions(np.random.default_rng(1), 20, 1e-2), box_length(20, 1e-2)
    images = positions + side * np.random.default_rng(2).integers(-5, 6, positions.shape)
    np.testing.assert_allclose(
        periodic_mobility(images, side), periodic_mobility(positions, side), atol=1e-12
    )
    with pytest.raises(ValueError, match="centres of spheres 0 and 1"):
        periodic_mobility([[0.001, 0, 0], [side - 0.001, 0, 0]], side)
    with pytest.raises(ValueError, match="shape"):
        periodic_mobility(np.zeros((4, 2)), side)


def test_overlapping_spheres_and_their_images_have_a_positive_mobility():
    positions = np.random.default_rng(3).uniform(0, 1.4, (3, 3))
    one, other = (periodic_mobility(positions, 1.4, 1e-14, splitting) for splitting in (4.0, 7.0))
    np.testing.assert_allclose(one, other, atol=1e-8)
    assert np.linalg.eigvalsh(one).min() > 0
