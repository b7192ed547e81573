"""Galerkin discretisation of the single-layer operator of Stokes flow on spheres.

With mu = 1 the velocity induced by a traction f is (1 / 8 pi) sum over spheres of the integral of
G(x - y) f(y) dS(y), G = I/r + r r^T / r^3 (paper, appendix A). The weak form: for every shape
function phi_a, <phi_a, single layer of f> = <phi_a, u_inf>. Traction and test functions are the
continuous piecewise quadratics on the projected elements; a sphere has diameter 1.

An integral over two elements is singular when they touch (Sauter-Schwab rule), and nearly singular
when they are close (`element_pairs`).
"""

import numpy as np
from numba import njit

from dustfall.stokes.elements.element import SHAPES, place_points, shape_functions
from dustfall.stokes.elements.element_pairs import coupling, side
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.quadrature import touching_pair_rule, triangle_rule
from dustfall.stokes.elements.stokeslet import stokeslet
from dustfall.units import RADIUS


@njit(cache=True)
def _points_on(corners, barycentric, position, shape, density):
    """Points of one projected element: unit vectors, shape functions, dS per unit of weight."""
    place_points(corners, barycentric, False, position, density)
    for q in range(len(barycentric)):
        l0, l1, l2 = barycentric[q]
        shape_functions(l0, l1, l2, shape[q])


def element_points(mesh: SphereMesh, rule: int):
    """Quadrature points of every element.

    Returns unit vectors (n_triangles, q, 3), shape functions (q, 6) and weights (n_triangles, q)
    on the unit sphere (sum 4 pi).
    """
    barycentric, weights = triangle_rule(rule)
    count = len(weights)
    position = np.empty((len(mesh.triangles), count, 3))
    shape = np.empty((count, SHAPES))
    density = np.empty((len(mesh.triangles), count))
    for e, corners in enumerate(mesh.vertices[mesh.triangles]):
        _points_on(corners, barycentric, position[e], shape, density[e])
    return position, shape, density * weights


@njit(cache=True)
def _add_matched_points(x, phi, y, psi, weights, block):
    """The same for points that come in pairs, as those of the Sauter-Schwab rule do."""
    g = np.empty(6)
    for p in range(len(weights)):
        stokeslet(
            RADIUS * (x[p, 0] - y[p, 0]),
            RADIUS * (x[p, 1] - y[p, 1]),
            RADIUS * (x[p, 2] - y[p, 2]),
            g,
        )
        for a in range(SHAPES):
            for b in range(SHAPES):
                factor = weights[p] * phi[p, a] * psi[p, b]
                for k in range(6):
                    block[a, b, k] += factor * g[k]


@njit(cache=True)
def _scatter(matrix, dofs_x, dofs_y, block, scale, mirrored):
    """Add an element block (6, 6, 6 entries) to the matrix of 3 x 3 node blocks."""
    place = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    for a in range(SHAPES):
        for b in range(SHAPES):
            for i in range(3):
                for j in range(3):
                    value = scale * block[a, b, place[i, j]]
                    matrix[3 * dofs_x[a] + i, 3 * dofs_y[b] + j] += value
                    if mirrored:
                        matrix[3 * dofs_y[b] + j, 3 * dofs_x[a] + i] += value


@njit(cache=True)
def _add_touching_pairs(matrix, corners, dofs, shared, order_x, order_y, rules):
    scale = RADIUS**4 / (8.0 * np.pi)
    largest = max(len(rules[0][2]), len(rules[1][2]), len(rules[2][2]))
    x, y = np.empty((largest, 3)), np.empty((largest, 3))
    phi, psi = np.empty((largest, SHAPES)), np.empty((largest, SHAPES))
    dx, dy = np.empty(largest), np.empty(largest)
    for e in range(len(corners)):
        for f in range(e + 1):
            common = shared[e, f]
            if common == 0:
                continue
            block = np.zeros((SHAPES, SHAPES, 6))
            px, py, w = rules[common - 1]
            count = len(w)
            # The rule wants shared vertices first: put its coordinates back in our order.
            bx, by = np.empty((count, 3)), np.empty((count, 3))
            for k in range(3):
                bx[:, order_x[e, f, k]] = px[:, k]
                by[:, order_y[e, f, k]] = py[:, k]
            _points_on(corners[e], bx, x[:count], phi[:count], dx[:count])
            _points_on(corners[f], by, y[:count], psi[:count], dy[:count])
            _add_matched_points(
                x[:count],
                phi[:count],
                y[:count],
                psi[:count],
                w * dx[:count] * dy[:count],
                block,
            )
            _scatter(matrix, dofs[e], dofs[f], block, scale, e != f)


def self_interaction(mesh: SphereMesh, singular: int = 6, tolerance: float = 1e-8) -> np.ndarray:
    """Single-layer matrix of one sphere, (3n, 3n), symmetric; row 3a + i is node a, direction i.

    singular: Gauss points a direction where elements touch. tolerance: relative error of an
    integral over two elements that do not.
    """
    triangles = mesh.triangles
    count = len(triangles)
    equal = triangles[:, None, :, None] == triangles[None, :, None, :]
    shared = equal.any(axis=3).sum(axis=2)
    order_x = np.broadcast_to(np.arange(3), (count, count, 3)).copy()
    order_y = order_x.copy()
    for e, f in zip(*np.nonzero((shared > 0) & (shared < 3)), strict=True):
        common = [v for v in triangles[e] if v in triangles[f]]
        for order, triangle in ((order_x, triangles[e]), (order_y, triangles[f])):
            rest = [v for v in triangle if v not in common]
            order[e, f] = [int(np.flatnonzero(triangle == v)[0]) for v in common + rest]
    own = side(mesh, tolerance)
    matrix = coupling(own, own, np.zeros(3), shared > 0)
    matrix = 0.5 * (matrix + matrix.T)
    rules = tuple(touching_pair_rule(k, singular) for k in (1, 2, 3))
    corners = mesh.vertices[triangles]
    _add_touching_pairs(matrix, corners, mesh.quadratic_nodes, shared, order_x, order_y, rules)
    return matrix


def nodal_integrals(mesh: SphereMesh, values, rule: int = 8) -> np.ndarray:
    """Integrals of phi_a g over the sphere, (n_nodes, k); values maps unit vectors to (..., k)."""
    position, shape, weights = element_points(mesh, rule)
    samples = values(position.reshape(-1, 3)).reshape(*weights.shape, -1)
    element = RADIUS**2 * np.einsum("eq,qa,eqk->eak", weights, shape, samples)
    dofs = mesh.quadratic_nodes
    out = np.zeros((dofs.max() + 1, element.shape[2]))
    np.add.at(out, dofs, element)
    return out
