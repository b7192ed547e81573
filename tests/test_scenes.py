"""Random scenes follow their law, and each depends on the seed and its own number alone."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.stats import kstest

from dustfall.scenes import (
    LAWS,
    MOST_PLACED,
    NEAR_CONTACT,
    densest,
    farthest_distance,
    random_scene,
    random_scenes,
    volume_fraction,
)

RANGE = (1e-8, 1e-3)


def test_volume_fraction_of_the_notes():
    assert farthest_distance(1e-3) == pytest.approx(8.55, abs=0.005)
    assert farthest_distance(1e-8) == pytest.approx(397, abs=0.5)
    phi = np.array([1e-8, 1e-5, 1e-2])
    for k in (3, 5, 8):
        np.testing.assert_allclose(volume_fraction(farthest_distance(phi, k), k), phi, rtol=1e-14)
    # Eight spheres of 1/8 of the volume of a ball of radius d_p, in a ball of 10 d_p.
    assert volume_fraction(10.0, 8) == pytest.approx(1e-3, rel=1e-14)


@pytest.mark.parametrize("number", [4, 5])
@pytest.mark.parametrize("law", LAWS)
def test_scenes_follow_their_law(law, number):
    neighbours, phi = random_scenes(1, law, range(1500), RANGE, number)
    distance = np.linalg.norm(neighbours, axis=2)
    farthest = farthest_distance(phi, number)
    assert (np.diff(distance, axis=1) >= 0).all()
    np.testing.assert_allclose(distance[:, -1], farthest, rtol=1e-12)
    assert kstest(np.log(phi), "uniform", (np.log(1e-8), np.log(1e5))).pvalue > 1e-3
    # Where there is much room, rejected overlaps do not show in the radii.
    dilute = farthest > 50
    inner, outer = distance[dilute, :-1], farthest[dilute, None]
    if law == "contact":
        low, high = NEAR_CONTACT
        assert kstest((inner[:, 0] - 1.0 - low) / (high - low), "uniform").pvalue > 1e-3
        inner = inner[:, 1:]
    if law == "ball":
        level = (inner**3 - 1.0) / (outer**3 - 1.0)
    else:
        level = (inner - 1.0) / (outer - 1.0)
    assert kstest(level.ravel(), "uniform").pvalue > 1e-3
    directions = neighbours / distance[:, :, None]
    assert np.abs(directions.mean(axis=(0, 1))).max() < 4.0 / np.sqrt(3 * directions[..., 0].size)


@pytest.mark.parametrize("number", [3, 5, MOST_PLACED])
@pytest.mark.parametrize("law", LAWS)
def test_no_spheres_overlap_in_the_densest_scenes(law, number):
    neighbours, _ = random_scenes(1, law, range(600), [densest(number)] * 2, number)
    assert neighbours.shape == (600, number, 3)
    spheres = np.concatenate([np.zeros((600, 1, 3)), neighbours], axis=1)
    assert min(pdist(own).min() for own in spheres) > 1.0


def test_a_scene_depends_on_seed_law_and_number_alone():
    together, phi = random_scenes(7, "uniform", range(20), RANGE)
    alone, own = random_scene(7, "uniform", 13, RANGE)
    np.testing.assert_array_equal(together[13], alone)
    assert phi[13] == own
    assert not np.array_equal(alone, random_scene(8, "uniform", 13, RANGE)[0])
    assert random_scene(7, "ball", 13, RANGE)[1] != own


def test_impossible_scenes_are_refused():
    with pytest.raises(ValueError, match="allowed are uniform, ball, contact"):
        random_scene(1, "cube", 0, RANGE)
    with pytest.raises(ValueError, match="21 neighbours: allowed are 1 to 20"):
        random_scene(1, "ball", 0, RANGE, 21)
    with pytest.raises(ValueError, match="1 neighbours: allowed are 2 to 20"):
        random_scene(1, "contact", 0, RANGE, 1)
    assert random_scene(1, "uniform", 0, RANGE, 1)[0].shape == (1, 3)
    for bad in ((1e-3, 1e-8), (0.0, 1e-3), (1e-8, 0.5)):
        with pytest.raises(ValueError, match="phi range"):
            random_scene(1, "ball", 0, bad)
