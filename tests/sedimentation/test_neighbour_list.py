import numpy as np
import pytest

from dustfall.sedimentation.blocks import Blocks
from dustfall.sedimentation.neighbour_list import REORDERED_EVERY, NeighbourList
from dustfall.sedimentation.neighbours import nearest_neighbours


def lattice(m):
    return (
        np.stack(np.meshgrid(*3 * [np.arange(m)], indexing="ij"), -1).reshape(-1, 3).astype(float)
    )


STARTS = {
    "six": (lambda rng: rng.random((6, 3)) * 4, 4.0),
    "thirty": (lambda rng: rng.random((30, 3)) * 9, 9.0),
    "random": (lambda rng: rng.random((1500, 3)) * 60, 60.0),
    "clustered": (
        lambda rng: rng.random((4, 3))[rng.integers(4, size=700)] * 40 + rng.normal(size=(700, 3)),
        40.0,
    ),
    "lattice": (lambda rng: lattice(7), 7.0),
    "far from the origin": (lambda rng: rng.random((400, 3)) * 60 - 1e6, 60.0),
}

MOTIONS = {
    "at rest": lambda rng, n: np.zeros((n, 3)),
    "all alike": lambda rng, n: np.tile([0.3, -0.1, -12.0], (n, 1)),
    "slow": lambda rng, n: [0, 0, -9] + 0.01 * rng.normal(size=(n, 3)),
    "fast": lambda rng, n: [0, 0, -9] + 0.7 * rng.normal(size=(n, 3)),
    "one fast particle": lambda rng, n: 0.01 * rng.normal(size=(n, 3)) + 5 * np.eye(n, 3),
    "through the box": lambda rng, n: 50 * rng.normal(size=(n, 3)),
}


@pytest.mark.parametrize("number", [1, 5, 12])
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("start", STARTS)
def test_moving_particles_have_the_neighbours_of_a_plain_search_to_the_last_bit(
    start, motion, number
):
    rng = np.random.default_rng(8)
    make, side = STARTS[start]
    position = make(rng)
    n = len(position)
    number = min(number, n - 1)
    velocity = MOTIONS[motion](rng, n)
    neighbours = NeighbourList(n, side, Blocks(n), number)
    for _ in range(12):
        vectors, index = nearest_neighbours(position, side, number)
        np.testing.assert_array_equal(neighbours.update(position), index)
        np.testing.assert_array_equal(neighbours.vectors(np.arange(n)), vectors)
        position = position + velocity + 0.02 * rng.normal(size=(n, 3)) * velocity.any()


def test_lists_that_are_put_in_order_again_change_nothing():
    rng = np.random.default_rng(9)
    position, velocity = rng.random((60, 3)) * 20, rng.normal(size=(60, 3))
    neighbours = NeighbourList(60, 20.0, Blocks(60))
    for k in range(REORDERED_EVERY + 3):
        index = neighbours.update(position + 0.05 * k * velocity)
        expected = nearest_neighbours(position + 0.05 * k * velocity, 20.0)[1]
        np.testing.assert_array_equal(index, expected)


def test_searches_are_few_where_particles_move_little_against_the_mean():
    rng = np.random.default_rng(10)
    position = rng.random((2000, 3)) * 100
    velocity = [0, 0, -30] + 0.05 * rng.normal(size=(2000, 3))
    neighbours = NeighbourList(2000, 100.0, Blocks(2000))
    searched = []
    for k in range(10):
        neighbours.update(position + k * velocity)
        searched.append(neighbours.searched)
    assert searched[0] == 2000
    assert sum(searched[1:]) < 600


def test_a_list_without_a_neighbour_is_refused():
    with pytest.raises(ValueError, match="number of neighbours is 0"):
        NeighbourList(60, 20.0, Blocks(60), 0).update(np.random.default_rng(1).random((60, 3)))


def test_equal_distances_are_ordered_by_row():
    cube = lattice(3)
    vectors, index = nearest_neighbours(cube, 3.0)
    np.testing.assert_array_equal(np.linalg.norm(vectors, axis=2), 1.0)
    assert (np.diff(index, axis=1) > 0).all()
