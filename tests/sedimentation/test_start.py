import numpy as np
import pytest
from scipy.spatial import cKDTree

from dustfall.sedimentation import box_length, random_positions


@pytest.mark.parametrize(
    ("particles", "volume_fraction"), [(6, 0.2), (40, 0.3), (1000, 0.3), (2000, 1e-3), (500, 1e-8)]
)
def test_random_spheres_do_not_overlap_and_are_complete(particles, volume_fraction):
    position = random_positions(np.random.default_rng(1), particles, volume_fraction)
    side = box_length(particles, volume_fraction)
    assert position.shape == (particles, 3)
    assert ((position >= 0) & (position < side)).all()
    distance, _ = cKDTree(position, boxsize=side).query(position, k=2)
    assert distance[:, 1].min() >= 1


def test_cube_holds_the_volume_fraction():
    assert 33_000 * np.pi / 6 / box_length(33_000, 1e-3) ** 3 == pytest.approx(1e-3)


def test_positions_hang_on_the_seed_alone():
    first, again, other = (random_positions(np.random.default_rng(s), 100, 0.1) for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_dilute_spheres_are_uniform_in_the_cube():
    position = random_positions(np.random.default_rng(2), 8000, 1e-6) / box_length(8000, 1e-6)
    octants = np.histogramdd(position, bins=2, range=3 * [(0, 1)])[0]
    # 1000 expected in each; five standard deviations.
    assert np.abs(octants - 1000).max() < 5 * np.sqrt(1000)


@pytest.mark.parametrize("volume_fraction", [0.0, -1e-3, 0.38, 0.74, float("nan")])
def test_impossible_packing_names_phi(volume_fraction):
    with pytest.raises(ValueError, match="phi"):
        random_positions(np.random.default_rng(1), 100, volume_fraction)


def test_jammed_packing_is_given_up_and_names_phi():
    with pytest.raises(ValueError, match=r"do not fit at volume fraction phi = 0\.379"):
        random_positions(np.random.default_rng(1), 200, 0.379)


def test_a_cube_without_a_particle_is_refused():
    with pytest.raises(ValueError, match="0 particles"):
        box_length(0, 1e-3)
