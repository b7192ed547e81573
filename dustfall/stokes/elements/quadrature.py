"""Quadrature on triangles and on pairs of triangles that touch.

Points on a triangle are barycentric coordinates (l0, l1, l2); weights add up to 1, so an integral
over a flat triangle is its area times the weighted sum.
"""

from functools import cache

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.special import roots_jacobi


@cache
def triangle_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Conical product rule: (n^2, 3) points and (n^2,) weights, exact up to degree 2n - 1."""
    u, wu = leggauss(n)
    v, wv = roots_jacobi(n, 1.0, 0.0)
    u, v = (u + 1.0) / 2.0, (v + 1.0) / 2.0
    l1 = (u[:, None] * (1.0 - v[None, :])).ravel()
    l2 = np.broadcast_to(v, (n, n)).ravel()
    weights = (wu[:, None] * wv[None, :]).ravel()
    points = np.column_stack([1.0 - l1 - l2, l1, l2])
    return np.ascontiguousarray(points), weights / weights.sum()


@cache
def touching_pair_rule(shared: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rule for a 1/r kernel on two triangles that share 1, 2 or 3 vertices.

    The relative coordinates of Sauter and Schwab (Boundary Element Methods, 2011, section 5.2)
    turn the integrand into a smooth one, to which n Gauss points a direction are applied.
    shared: number of common vertices; they come first, in the same order, in both triangles.
    Returns barycentric points on the first and on the second triangle, each (q, 3), and weights
    (q,) that add up to 1.
    """
    t, w = leggauss(n)
    t, w = (t + 1.0) / 2.0, w / 2.0
    xi, a, b, c = (g.ravel() for g in np.meshgrid(t, t, t, t, indexing="ij"))
    w4 = np.einsum("i,j,k,l->ijkl", w, w, w, w).ravel()
    # Each region: (x1, x2), (y1, y2) on the triangle 0 < x2 < x1 < 1, before the factor xi.
    if shared == 3:
        weight = 4.0 * xi**3 * a**2 * b
        first = [
            ((1, 1 - a + a * b), (1 - a * b * c, 1 - a)),
            ((1, a * (1 - b + b * c)), (1 - a * b, a * (1 - b))),
            ((1 - a * b * c, a * (1 - b * c)), (1, a * (1 - b))),
        ]
        regions = [(x, y, weight) for x, y in first] + [(y, x, weight) for x, y in first]
    elif shared == 2:
        outer, inner = 4.0 * xi**3 * a**2, 4.0 * xi**3 * a**2 * b
        regions = [
            ((1, a * c), (1 - a * b, a * (1 - b)), outer),
            ((1, a), (1 - a * b * c, a * b * (1 - c)), inner),
            ((1 - a * b, a * (1 - b)), (1, a * b * c), inner),
            ((1 - a * b * c, a * b * (1 - c)), (1, a), inner),
            ((1 - a * b * c, a * (1 - b * c)), (1, a * b), inner),
        ]
    elif shared == 1:
        weight = 4.0 * xi**3 * b
        one, other = (1, a), (b, b * c)
        regions = [(one, other, weight), (other, one, weight)]
    else:
        raise ValueError(f"shared = {shared} vertices: touching triangles share 1, 2 or 3")

    def barycentric(point):
        p1, p2 = (xi * coordinate for coordinate in point)
        return np.column_stack([1.0 - p1, p1 - p2, p2])

    x = np.concatenate([barycentric(region[0]) for region in regions])
    y = np.concatenate([barycentric(region[1]) for region in regions])
    weights = np.concatenate([w4 * region[2] for region in regions])
    return x, y, weights
