"""The search finds what comparing all pairs finds."""

from itertools import product

import numpy as np
import pytest


def brute_force(positions, period, number=5):
    """Rows (n, number) and distances of the nearest neighbours; ties by row."""
    separation = positions[None] - positions[:, None]
    for axis in np.flatnonzero(period):
        separation[..., axis] -= period[axis] * np.rint(separation[..., axis] / period[axis])
    distance = np.linalg.norm(separation, axis=2)
    np.fill_diagonal(distance, np.inf)
    rows = np.argsort(distance, axis=1, kind="stable")[:, :number]
    return rows, np.take_along_axis(distance, rows, axis=1)


def clouds():
    """Clouds of points in the box of sides (3, 1, 2), some of them hard for cells."""
    rng = np.random.default_rng(1)
    sides = np.array([3.0, 1.0, 2.0])
    uniform = rng.random((700, 3)) * sides
    clustered = 0.5 * sides + 1e-3 * rng.normal(size=(300, 3))
    clustered[:20] = rng.random((20, 3)) * sides
    outside = uniform + sides * rng.integers(-3, 4, (700, 3))
    plane = uniform[:200] * [1, 0, 1]
    line = uniform[:100] * [0, 0, 1]
    corner = 0.02 * uniform[:100]
    faces = np.rint(uniform[:300] / sides) * sides * (1 + 1e-9 * rng.normal(size=(300, 3)))
    return {
        "uniform": uniform,
        "clustered": clustered,
        "outside": outside,
        "plane": plane,
        "line": line,
        "corner": corner,
        "faces": faces,
        "six": uniform[:6],
        "twenty": uniform[:20],
    }


@pytest.mark.parametrize("axes", list(product((0, 1), repeat=3)))
@pytest.mark.parametrize("cloud", clouds())
def test_the_neighbours_are_those_of_all_pairs(cloud, axes, library):
    positions, period = clouds()[cloud], np.array([3.0, 1.0, 2.0]) * axes
    expected, distance = brute_force(positions, period)
    vectors, rows = library.nearest(positions, period)
    np.testing.assert_array_equal(rows, expected)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=2), distance, rtol=0, atol=1e-14 * 12)


def test_a_vector_leads_to_an_image_of_the_neighbour(library):
    positions, period = clouds()["outside"], np.array([3.0, 1.0, 2.0])
    vectors, rows = library.nearest(positions, period)
    turns = (positions[:, None] + vectors - positions[rows]) / period
    np.testing.assert_allclose(turns, np.rint(turns), rtol=0, atol=1e-13)
    assert (np.abs(vectors) <= period / 2 * (1 + 1e-12)).all()


@pytest.mark.parametrize("axes", [(0, 0, 0), (1, 1, 1)])
def test_on_a_lattice_ties_go_to_the_lower_row(axes, library):
    lattice = np.array(list(product(range(4), repeat=3)), dtype=float)
    lattice = np.random.default_rng(0).permutation(lattice)
    expected, _ = brute_force(lattice, 4.0 * np.array(axes))
    _, rows = library.nearest(lattice, 4.0 * np.array(axes))
    np.testing.assert_array_equal(rows, expected)


@pytest.mark.parametrize("number", [1, 2, 8, 19])
def test_any_number_of_neighbours_can_be_asked_for(number, library):
    positions, period = clouds()["twenty"], np.array([3.0, 0.0, 2.0])
    _, rows = library.nearest(positions, period, number)
    np.testing.assert_array_equal(rows, brute_force(positions, period, number)[0])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda p, period: (p[:5], period), "one point more than neighbours"),
        (lambda p, period: (p * np.nan, period), "coordinate 0 of point 0 is not finite"),
        (lambda p, period: (p, -period), "period along axis 0 is -1"),
        (lambda p, period: (p, np.inf * period), "period along axis 0 is inf"),
    ],
)
def test_what_has_no_neighbours_is_refused_with_a_sentence(change, sentence, library):
    positions = np.random.default_rng(0).random((10, 3))
    with pytest.raises(ValueError, match=sentence):
        library.nearest(*change(positions, np.ones(3)))
