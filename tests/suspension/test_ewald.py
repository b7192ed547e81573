"""The product with the periodic mobility agrees with exact values, the dense sum and itself."""

import numpy as np
import pytest

from dustfall.sedimentation.start import random_positions
from dustfall.sedimentation.state import box_length
from dustfall.suspension import PeriodicMobility
from dustfall.suspension.periodic import HASIMOTO, RADIUS, periodic_mobility
from dustfall.suspension.splitting import choose_splitting

DOWN = np.array([0.0, 0.0, -1.0])


def random_points(seed, n, phi):
    """Positions that may overlap, and the side of their cube."""
    side = box_length(n, phi)
    return np.random.default_rng(seed).uniform(0, side, (n, 3)), side


def relative_error(velocities, expected):
    return np.linalg.norm(velocities - expected) / np.linalg.norm(expected)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-8])
@pytest.mark.parametrize(("side", "expected"), [(10.0, 0.8586587248), (40.0, 0.9645419627)])
def test_a_lone_sphere_settles_as_a_cubic_lattice(side, expected, tolerance):
    # 1 - 2.8372974795 q + 4 pi / 3 q^3, q = radius / side, wherever the sphere is.
    for position in np.random.default_rng(1).uniform(-side, side, (5, 1, 3)):
        velocity = PeriodicMobility(position, side, tolerance).velocities(DOWN[None])
        np.testing.assert_allclose(velocity, expected * DOWN[None], atol=tolerance)


@pytest.mark.parametrize(
    ("n", "phi"),
    [(2, 0.4), (2, 1e-6), (5, 0.01), (20, 0.1), (30, 1e-4), (150, 1e-6), (150, 1e-3), (150, 0.1)],
)
def test_the_error_is_below_the_tolerance_at_any_density(n, phi):
    rng = np.random.default_rng([n, int(1 / phi)])
    side = box_length(n, phi)
    everywhere = rng.uniform(0, side, (n, 3))
    # Crowded around a corner of the cube, so that images meet.
    cluster = side * 0.98 + rng.normal(size=(n, 3)) * side / 10
    for positions in (everywhere, cluster):
        exact = periodic_mobility(positions, side, 1e-13)
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
            mobility = PeriodicMobility(positions, side, tolerance)
            for forces in (rng.normal(size=(n, 3)), np.tile(DOWN, (n, 1))):
                expected = (exact @ forces.ravel()).reshape(n, 3)
                assert relative_error(mobility.velocities(forces), expected) < tolerance


def test_spheres_that_overlap_and_even_coincide_have_a_positive_mobility():
    side = 6.0
    positions = np.random.default_rng(3).normal(size=(12, 3)) * 0.3
    positions[1] = positions[0]
    mobility = PeriodicMobility(positions, side, 1e-8)
    unit = np.eye(36).reshape(36, 12, 3)
    matrix = np.array([mobility.velocities(forces).ravel() for forces in unit])
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-8)
    # Two spheres at one place move alike: a pull that parts them moves nothing, in any direction.
    eigenvalues = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    assert np.abs(eigenvalues[:3]).max() < 1e-7
    assert eigenvalues[3] > 1e-3


@pytest.mark.parametrize("n", [1, 7, 120])
def test_another_splitting_changes_nothing(n):
    positions, side = random_points(4, n, 0.02)
    forces = np.random.default_rng(5).normal(size=(n, 3))
    own = choose_splitting(n, side, 1e-7)
    other = choose_splitting(n, side, 1e-7, crowding=30.0)
    assert other.reach < 0.7 * own.reach
    one, two = (
        PeriodicMobility(positions, side, splitting=splitting).velocities(forces)
        for splitting in (own, other)
    )
    assert relative_error(one, two) < 2e-7


def test_images_and_order_of_the_spheres_change_nothing():
    n = 60
    positions, side = random_points(6, n, 0.01)
    rng = np.random.default_rng(7)
    forces, order = rng.normal(size=(n, 3)), rng.permutation(n)
    velocities = PeriodicMobility(positions, side, 1e-8).velocities(forces)
    images = positions + side * rng.integers(-3, 4, (n, 3))
    moved = PeriodicMobility(images[order], side, 1e-8).velocities(forces[order])
    np.testing.assert_allclose(moved, velocities[order], atol=1e-10)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_any_number_of_threads_gives_the_same_bits(tolerance):
    positions, side = random_points(8, 3000, 1e-3)
    forces = np.random.default_rng(9).normal(size=(3000, 3))
    one, two, three = (
        PeriodicMobility(positions, side, tolerance, threads).velocities(forces)
        for threads in (1, 2, 3)
    )
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, three)


def test_a_large_cloud_is_right_too():
    """Where the matrix does not fit, the finest splitting stands for the truth."""
    n = 8000
    positions, side = random_points(10, n, 1e-3)
    rng = np.random.default_rng(11)
    exact = PeriodicMobility(positions, side, 1e-8)
    for tolerance in (1e-3, 1e-5):
        mobility = PeriodicMobility(positions, side, tolerance)
        for forces in (rng.normal(size=(n, 3)), np.tile(DOWN, (n, 1))):
            expected = exact.velocities(forces)
            assert relative_error(mobility.velocities(forces), expected) < tolerance


def test_a_lump_in_a_large_cube_is_right():
    n, side = 2000, 1000.0
    rng = np.random.default_rng(12)
    positions = rng.normal(size=(n, 3)) * 12
    forces = rng.normal(size=(n, 3))
    mobility = PeriodicMobility(positions, side, 1e-3)
    expected = PeriodicMobility(positions, side, 1e-7).velocities(forces)
    assert relative_error(mobility.velocities(forces), expected) < 1e-3


def test_random_clouds_settle_with_five_times_the_volume_fraction_less():
    """For hard spheres at random, Rotne-Prager's tensor has 1 - 5 phi exactly (Batchelor 1972)."""
    phi, n, clouds = 0.01, 800, 24
    side = box_length(n, phi)
    speeds = []
    for cloud in range(clouds):
        positions = random_positions(np.random.default_rng([13, cloud]), n, phi)
        velocities = PeriodicMobility(positions, side).velocities(np.tile(DOWN, (n, 1)))
        speeds.append(-velocities[:, 2].mean() + HASIMOTO * RADIUS / side)
    error = np.std(speeds, ddof=1) / np.sqrt(clouds)
    assert error < 0.007
    assert abs(np.mean(speeds) - (1 - 5 * phi)) < 3 * error


def test_velocities_of_random_points_vary_as_the_sum_over_waves():
    """Without correlation the variance grows with the cube's side (Caflisch & Luke 1985)."""
    n, phi, clouds = 500, 1e-4, 40
    side = box_length(n, phi)
    k = 2 * np.pi / side * np.fft.fftfreq(64, 1 / 64)
    kx, ky, kz = np.meshgrid(k, k, k)
    square = kx**2 + ky**2 + kz**2
    square[0, 0, 0] = 1.0
    wave = (1 - kz**2 / square) / square * np.sinc(np.sqrt(square) * RADIUS / np.pi) ** 2
    wave[0, 0, 0] = 0.0
    expected = n * (3 * np.pi / side**3) ** 2 * (wave**2).sum()
    found = []
    for cloud in range(clouds):
        positions = np.random.default_rng([14, cloud]).uniform(0, side, (n, 3))
        velocities = PeriodicMobility(positions, side).velocities(np.tile(DOWN, (n, 1)))
        found.append((velocities[:, 2] ** 2).mean() - velocities[:, 2].mean() ** 2)
    error = np.std(found, ddof=1) / np.sqrt(clouds)
    assert error < 0.1 * expected
    assert abs(np.mean(found) - expected) < 3 * error


def test_what_does_not_fit_into_memory_is_refused_before_it_is_taken(monkeypatch):
    positions, side = random_points(15, 500, 1e-3)
    needed = PeriodicMobility(positions, side).bytes
    monkeypatch.setattr("os.sysconf", lambda name: needed - 1 if name == "SC_PHYS_PAGES" else 1)
    with pytest.raises(MemoryError, match=r"500 spheres needs .* GiB"):
        PeriodicMobility(positions, side)


def test_memory_is_linear_in_the_number_of_spheres():
    small, large = (PeriodicMobility(*random_points(16, n, 1e-3)).bytes / n for n in (4000, 32000))
    assert large < 1.1 * small
    assert large < 2000


@pytest.mark.parametrize(
    ("positions", "settings", "message"),
    [
        (np.zeros((0, 3)), {}, r"not \(0, 3\)"),
        (np.zeros((4, 2)), {}, r"not \(4, 2\)"),
        ([[0.0, 0.0, 0.0], [1.0, np.nan, 0.0]], {}, "sphere 1"),
        (np.zeros((1, 3)), {"side": 0.0}, "side of the cube is 0.0"),
        (np.zeros((1, 3)), {"side": np.inf}, "side of the cube is inf"),
        (np.zeros((1, 3)), {"tolerance": 1e-12}, "tolerance is 1e-12: allowed are 1e-08 to 0.1"),
        (np.zeros((1, 3)), {"tolerance": np.nan}, "tolerance is nan"),
        (np.zeros((1, 3)), {"threads": 0}, "threads is 0"),
        (np.zeros((1, 3)), {"splitting": choose_splitting(1, 9.0, 1e-3)}, "for a side of 9.0"),
    ],
)
def test_bad_input_is_refused_by_name(positions, settings, message):
    with pytest.raises(ValueError, match=message):
        PeriodicMobility(positions, **{"side": 10.0} | settings)


@pytest.mark.parametrize("forces", [np.zeros((1, 3)), np.zeros(6), np.full((2, 3), np.inf)])
def test_bad_forces_are_refused(forces):
    with pytest.raises(ValueError, match="forces"):
        PeriodicMobility(np.eye(3)[:2] * 3, 10.0).velocities(forces)
