"""GMRES solves what a dense solve does, and its residual is the true one."""

import numpy as np
import pytest
from scipy.sparse.linalg import gmres

from dustfall.stokes.gmres import combined, extended, started


def solved(matrix, right, tolerance, most):
    """Solution, iterations and the norms of the residual that the iteration reports."""
    krylov = started(right, most)
    norms = [np.linalg.norm(right)]
    while len(norms) <= most and norms[-1] > tolerance * norms[0]:
        basis = krylov[0]
        basis[len(norms)] = matrix @ basis[len(norms) - 1]
        norms.append(extended(krylov, len(norms) - 1))
    return combined(krylov, len(norms) - 1), norms


def system(size=40, seed=3):
    rng = np.random.default_rng(seed)
    return np.eye(size) + rng.normal(size=(size, size)) / (2 * np.sqrt(size)), rng.normal(size=size)


def test_the_solution_is_that_of_a_dense_solve():
    matrix, right = system()
    solution, _ = solved(matrix, right, 1e-13, 40)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), rtol=0, atol=1e-11)


@pytest.mark.parametrize("most", [1, 4, 11])
def test_the_reported_residual_is_the_true_one_and_the_smallest(most):
    matrix, right = system()
    solution, norms = solved(matrix, right, 0.0, most)
    assert np.linalg.norm(right - matrix @ solution) == pytest.approx(norms[-1], rel=1e-10)
    assert norms == sorted(norms, reverse=True)
    # The same as an independent code finds in as many iterations.
    theirs, _ = gmres(matrix, right, rtol=0.0, restart=most, maxiter=1)
    np.testing.assert_allclose(solution, theirs, atol=1e-9)


def test_few_eigenvalues_take_as_few_iterations():
    values = np.repeat([1.0, 2.0, 5.0], 7)
    _, right = system(21)
    solution, norms = solved(np.diag(values), right, 1e-12, 20)
    assert len(norms) - 1 == 3
    np.testing.assert_allclose(solution, right / values, rtol=1e-10)
