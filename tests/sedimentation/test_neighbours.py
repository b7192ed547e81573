import numpy as np
import pytest
from scipy.spatial import cKDTree

from dustfall.sedimentation import nearest_neighbours


def reference(position, side):
    distance, index = cKDTree(position % side, boxsize=side).query(position % side, k=6)
    return distance[:, 1:], index[:, 1:]


def clustered(rng, n, side):
    centres = rng.random((5, 3)) * side
    return centres[rng.integers(5, size=n)] + rng.normal(scale=0.01 * side, size=(n, 3))


def thin_around_cloud(rng):
    # So few points a cell outside the cloud that the fifth neighbour is seldom in a cell beside.
    return np.vstack([rng.random((8000, 3)) * 80, rng.normal(loc=30, scale=4, size=(12_000, 3))])


def cluster_and_pair(rng):
    return np.vstack([rng.normal(scale=0.01, size=(998, 3)), [[25, 25, 25], [26, 25, 25]]])


def jittered_lattice(rng, m):
    lattice = np.stack(np.meshgrid(*3 * [np.arange(m)], indexing="ij"), -1).reshape(-1, 3)
    return lattice + rng.uniform(-0.05, 0.05, size=lattice.shape)


POINTS = {
    "six": (lambda rng: rng.random((6, 3)) * 4, 4.0),
    "seven": (lambda rng: rng.random((7, 3)) * 4, 4.0),
    "just too few for three cells a side": (lambda rng: rng.random((53, 3)), 1.0),
    "just enough for three cells a side": (lambda rng: rng.random((54, 3)), 1.0),
    "random": (lambda rng: rng.random((4000, 3)) * 80, 80.0),
    "dilute": (lambda rng: rng.random((1000, 3)) * 12_000, 12_000.0),
    "thin around a cloud": (thin_around_cloud, 80.0),
    "outside the box": (lambda rng: rng.normal(scale=300, size=(1000, 3)), 50.0),
    "clustered": (lambda rng: clustered(rng, 3000, 40.0), 40.0),
    "one cluster and a lone pair": (cluster_and_pair, 50.0),
    "dense": (lambda rng: jittered_lattice(rng, 12), 12.0),
    "on the faces": (lambda rng: rng.integers(0, 9, size=(300, 3)) + 1e-3 * rng.random(3), 9.0),
}


@pytest.mark.parametrize("case", POINTS)
def test_neighbours_are_the_five_nearest_of_a_periodic_tree(case):
    make, side = POINTS[case]
    position = make(np.random.default_rng(3))
    vectors, index = nearest_neighbours(position, side)
    distance, expected = reference(position, side)
    tolerance = 1e-11 * max(side, np.abs(position).max())
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=2), distance, atol=tolerance, rtol=0)
    distinct = np.diff(distance, axis=1, append=np.inf).min(axis=1) > 10 * tolerance
    if case != "on the faces":
        assert distinct.mean() > 0.99
        same = np.sort(index, axis=1) == np.sort(expected, axis=1)
        sixth = cKDTree(position % side, boxsize=side).query(position % side, k=7)[0][:, 6]
        assert same[distinct & (sixth - distance[:, 4] > 10 * tolerance)].all()


@pytest.mark.parametrize("number", [1, 12, 50])
def test_any_number_of_nearest_is_found(number):
    position, side = np.random.default_rng(6).random((300, 3)) * 7.0, 7.0
    vectors, index = nearest_neighbours(position, side, number)
    distance, expected = cKDTree(position, boxsize=side).query(position, k=number + 1)
    np.testing.assert_array_equal(index, expected[:, 1:])
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=2), distance[:, 1:], atol=1e-12)


def test_vectors_lead_to_the_neighbours_up_to_whole_sides():
    rng = np.random.default_rng(4)
    position, side = rng.normal(scale=100, size=(500, 3)), 30.0
    vectors, index = nearest_neighbours(position, side)
    sides = (position[index] - position[:, None] - vectors) / side
    np.testing.assert_allclose(sides, np.rint(sides), atol=1e-12)


def test_vectors_do_not_change_under_translation():
    rng = np.random.default_rng(5)
    position, side = rng.random((800, 3)) * 25, 25.0
    vectors, index = nearest_neighbours(position, side)
    shift = np.array([3.7, -110.2, 63.1])
    moved_vectors, moved_index = nearest_neighbours(position + shift, side)
    np.testing.assert_array_equal(moved_index, index)
    np.testing.assert_allclose(moved_vectors, vectors, atol=1e-11)


@pytest.mark.parametrize(
    ("position", "side", "named"),
    [
        (np.zeros((5, 3)), 1.0, "5 particles: at least 6"),
        (np.zeros((6, 2)), 1.0, r"\(6, 2\)"),
        (np.zeros((6, 3)), 0.0, "box_length is"),
        (np.where(np.arange(18).reshape(6, 3) == 7, np.nan, 0.5), 1.0, "particle 2"),
        (
            np.where(np.arange(18).reshape(6, 3) == 7, 1e300, 0.5),
            1.0,
            "particle 2 .* 1e[+]09 sides",
        ),
        (np.zeros((6, 3)), 1e300, "box_length is"),
        (np.ma.masked_equal(np.eye(6, 3), 1.0), 20.0, r"value at \[0, 0\] is missing"),
        (["near", "far"], 1.0, "positions must be an array of numbers"),
    ],
)
def test_impossible_input_is_refused_by_name(position, side, named):
    with pytest.raises(ValueError, match=named):
        nearest_neighbours(position, side)


@pytest.mark.parametrize("number", [0, -1, 2.0, np.float64(2.0), None, "two"])
def test_a_number_of_neighbours_that_is_none_is_refused(number):
    with pytest.raises(ValueError, match=r"number of neighbours is .* integer of at least 1"):
        nearest_neighbours(np.eye(6, 3), 5.0, number)
