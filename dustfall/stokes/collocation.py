"""Constant traction, collocation at centroids: the scheme of the paper, in free space.

It serves the mesh study only. `flat` elements are the paper's; projected ones show how much of its
error is geometry.
"""

import numpy as np
from numba import njit
from numpy.polynomial.legendre import leggauss

from dustfall.stokes.mesh import SphereMesh
from dustfall.stokes.quadrature import triangle_rule
from dustfall.stokes.single_layer import RADIUS, put_block, stokeslet


def drag_on_isolated_sphere(mesh: SphereMesh, flat: bool) -> float:
    """Force along a unit flow, in units of mu U d_p (exactly 3 pi on the exact sphere)."""
    barycentric, weights = _singular_rule(8)
    corners = mesh.vertices[mesh.triangles]
    centre = np.full((1, 3), 1.0 / 3.0)
    x, _ = _surface_points(corners, centre, flat)
    x = x[:, 0]
    near, far = triangle_rule(8), triangle_rule(3)
    points = [_surface_points(corners, rule, flat) for rule in (barycentric, near[0], far[0])]
    rules = [(p, d * w) for (p, d), w in zip(points, (weights, near[1], far[1]), strict=True)]
    area = rules[0][1].sum(axis=1)
    matrix = _assemble(x, np.sqrt(area), rules[0], rules[1], rules[2])
    # The pressure inside is arbitrary: fix it, as it exerts no force.
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    matrix += np.outer(normal.ravel(), (area[:, None] * normal).ravel())
    traction = np.linalg.solve(matrix, np.tile([0.0, 1.0, 0.0], len(x)))
    return float(area @ traction[1::3])


def _singular_rule(n: int):
    """Duffy's rule (1982) for a 1/r singularity at the centroid: three triangles around it."""
    t, w = leggauss(n)
    t, w = (t + 1.0) / 2.0, w / 2.0
    u, v = (g.ravel() for g in np.meshgrid(t, t, indexing="ij"))
    weights = np.outer(w, w).ravel() * 2.0 * u / 3.0
    rows = []
    for k in range(3):
        b = np.repeat(((1.0 - u) / 3.0)[:, None], 3, axis=1)
        b[:, k] += u * (1.0 - v)
        b[:, (k + 1) % 3] += u * v
        rows.append(b)
    return np.concatenate(rows), np.tile(weights, 3)


def _surface_points(corners, barycentric, flat):
    """Points (e, q, 3) [d_p] and area per unit weight (e, q) [d_p^2]."""
    points = np.einsum("qk,ekc->eqc", barycentric, corners)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    if flat:
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return RADIUS * points, RADIUS**2 * np.repeat(area[:, None], len(barycentric), axis=1)
    triple = np.einsum("ec,ec->e", a, np.cross(b, c))
    r = np.linalg.norm(points, axis=2)
    return RADIUS * points / r[:, :, None], RADIUS**2 * 0.5 * triple[:, None] / r**3


_NEAR_WIDTHS = 3.0
"""Elements closer than this many of their widths take the dense rule."""


@njit(cache=True)
def _assemble(x, width, singular, near, far):
    n = len(x)
    matrix = np.empty((3 * n, 3 * n))
    g, entry = np.empty(6), np.empty(6)
    for e in range(n):
        for f in range(n):
            distance = np.sqrt(np.sum((x[e] - x[f]) ** 2))
            if e == f:
                points, weights = singular
            elif distance < _NEAR_WIDTHS * width[f]:
                points, weights = near
            else:
                points, weights = far
            entry[:] = 0.0
            for q in range(points.shape[1]):
                y = points[f, q]
                stokeslet(x[e, 0] - y[0], x[e, 1] - y[1], x[e, 2] - y[2], g)
                for k in range(6):
                    entry[k] += weights[f, q] * g[k]
            put_block(matrix, e, f, entry / (8.0 * np.pi))
    return matrix
