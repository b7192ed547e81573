"""Conjugate gradients, for systems known by their product alone."""

from collections.abc import Callable

import numpy as np

MOST_PRODUCTS = 1000
"""Products after which a solution is given up; ten are usual."""


def conjugate_gradients(
    product: Callable[[np.ndarray], np.ndarray],
    right: np.ndarray,
    start: np.ndarray,
    tolerance: float,
) -> tuple[np.ndarray, int]:
    """Solve product(x) = right for a symmetric positive definite product, all (n, 3).

    Until the residual's norm is below `tolerance` times that of `right` (Hestenes & Stiefel 1952).
    Returns x and the number of products. Raises FloatingPointError where that takes more than
    `MOST_PRODUCTS`. SciPy's solver sums by BLAS, whose bits change with the number of threads.
    """
    x = start.astype(np.float64)
    residual = right - product(x)
    direction = residual.copy()
    square = (residual**2).sum()
    goal = tolerance**2 * (right**2).sum()
    products = 1
    while square > goal:
        if products == MOST_PRODUCTS:
            raise FloatingPointError(
                f"conjugate gradients are at {np.sqrt(square)} after {products} products, "
                f"and {np.sqrt(goal)} is needed"
            )
        image = product(direction)
        products += 1
        length = square / (direction * image).sum()
        x += length * direction
        residual -= length * image
        before, square = square, (residual**2).sum()
        direction = residual + square / before * direction
    if not np.isfinite(square):
        raise FloatingPointError("forces are not finite")
    return x, products
