"""Every rule integrates what it promises to."""

from math import factorial

import numpy as np
import pytest

from dustfall.stokes.elements.quadrature import touching_pair_rule, triangle_rule


def mean_of_monomial(i, j, k):
    """Mean of l0^i l1^j l2^k over a triangle."""
    return 2 * factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 2)


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8])
def test_triangle_rule_is_exact_to_its_degree(n):
    points, weights = triangle_rule(n)
    for i in range(2 * n):
        for j in range(2 * n - i):
            k = 2 * n - 1 - i - j
            value = weights @ (points[:, 0] ** i * points[:, 1] ** j * points[:, 2] ** k)
            assert value == pytest.approx(mean_of_monomial(i, j, k), rel=1e-12)


@pytest.mark.parametrize("shared", [1, 2, 3])
def test_touching_pair_rule_is_exact_for_polynomials(shared):
    x, y, weights = touching_pair_rule(shared, 4)
    for i, j in [(0, 0), (1, 0), (0, 2), (2, 1), (1, 1)]:
        value = weights @ (x[:, 1] ** i * y[:, 2] ** j)
        expected = mean_of_monomial(0, i, 0) * mean_of_monomial(0, 0, j)
        assert value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("shared", [1, 2, 3])
def test_touching_pair_rule_converges_for_an_inverse_distance(shared):
    """Two right triangles in a plane that share vertices, kernel 1/r."""
    first = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    second = {
        3: first,
        2: np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]]),
        1: np.array([[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0]]),
    }[shared]
    values = []
    for n in (5, 10, 14):
        x, y, weights = touching_pair_rule(shared, n)
        values.append(weights @ (1.0 / np.linalg.norm(x @ first - y @ second, axis=1)))
    assert values[1] == pytest.approx(values[2], rel=1e-8)
    assert values[0] == pytest.approx(values[2], rel=1e-4)


def test_mean_inverse_distance_within_a_square_is_the_known_constant():
    """Two triangles make a unit square, whose mean 1/r is 4 ln(1+sqrt 2) - 4 (sqrt 2 - 1) / 3."""
    lower = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0]])
    upper = np.array([[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    same, across = (
        weights @ (1.0 / np.linalg.norm(x @ lower - y @ other, axis=1))
        for other, (x, y, weights) in (
            (lower, touching_pair_rule(3, 12)),
            (upper, touching_pair_rule(2, 12)),
        )
    )
    known = 4.0 * np.log(1.0 + np.sqrt(2.0)) - 4.0 * (np.sqrt(2.0) - 1.0) / 3.0
    assert 0.5 * (same + across) == pytest.approx(known, rel=1e-8)


def test_rules_that_do_not_exist_are_refused():
    with pytest.raises(ValueError, match="share 1, 2 or 3"):
        touching_pair_rule(0, 3)
