"""Galerkin discretisation of the single-layer operator of Stokes flow on spheres.

With mu = 1 the velocity induced by a traction f is (1 / 8 pi) sum over spheres of the integral of
G(x - y) f(y) dS(y), G = I/r + r r^T / r^3 (paper, appendix A). The weak form: for every shape
function phi_a, <phi_a, single layer of f> = <phi_a, u_inf>. Traction and test functions are the
continuous piecewise quadratics on the projected elements; a sphere has diameter 1.

An integral over two elements is singular when they touch (Sauter-Schwab rule) and nearly singular
when they are close: then the larger element is halved in both directions until each pair is as
far apart as it is wide.
"""

import numpy as np
from numba import njit

from dustfall.stokes.elements.element import (
    MOST_HALVINGS,
    MOST_PARTS,
    centre_and_reach,
    parts_facing,
    place_points,
    quarter,
    share_of_area,
)
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.quadrature import touching_pair_rule, triangle_rule
from dustfall.units import RADIUS

SHAPES = 6
"""Quadratic shape functions on an element: three vertices, then edges 01, 12, 20."""


@njit(cache=True, inline="always")
def shape_functions(l0, l1, l2, out):
    out[0] = l0 * (2.0 * l0 - 1.0)
    out[1] = l1 * (2.0 * l1 - 1.0)
    out[2] = l2 * (2.0 * l2 - 1.0)
    out[3] = 4.0 * l0 * l1
    out[4] = 4.0 * l1 * l2
    out[5] = 4.0 * l2 * l0


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


@njit(cache=True, inline="always")
def stokeslet(dx, dy, dz, out):
    """Six independent entries xx, xy, xz, yy, yz, zz of I/r + r r^T / r^3."""
    r2 = dx * dx + dy * dy + dz * dz
    inverse = 1.0 / np.sqrt(r2)
    cube = inverse / r2
    out[0] = inverse + dx * dx * cube
    out[1] = dx * dy * cube
    out[2] = dx * dz * cube
    out[3] = inverse + dy * dy * cube
    out[4] = dy * dz * cube
    out[5] = inverse + dz * dz * cube


@njit(cache=True, inline="always")
def put_block(matrix, a, b, entries):
    """Write the six independent entries as the symmetric 3 x 3 block (a, b) of a matrix."""
    matrix[3 * a, 3 * b] = entries[0]
    matrix[3 * a + 1, 3 * b + 1] = entries[3]
    matrix[3 * a + 2, 3 * b + 2] = entries[5]
    matrix[3 * a, 3 * b + 1] = matrix[3 * a + 1, 3 * b] = entries[1]
    matrix[3 * a, 3 * b + 2] = matrix[3 * a + 2, 3 * b] = entries[2]
    matrix[3 * a + 1, 3 * b + 2] = matrix[3 * a + 2, 3 * b + 1] = entries[4]


@njit(cache=True)
def _add_point_pairs(x, phi, wx, y, psi, wy, block):
    """block[a, b] += sum over points of wx phi_a(x) G(RADIUS (x - y)) psi_b(y) wy."""
    g = np.empty(6)
    inner = np.empty((SHAPES, 6))
    for p in range(len(wx)):
        inner[:] = 0.0
        for q in range(len(wy)):
            stokeslet(
                RADIUS * (x[p, 0] - y[q, 0]),
                RADIUS * (x[p, 1] - y[q, 1]),
                RADIUS * (x[p, 2] - y[q, 2]),
                g,
            )
            for b in range(SHAPES):
                factor = psi[q, b] * wy[q]
                for k in range(6):
                    inner[b, k] += factor * g[k]
        for a in range(SHAPES):
            factor = phi[p, a] * wx[p]
            for b in range(SHAPES):
                for k in range(6):
                    block[a, b, k] += factor * inner[b, k]


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
def _add_separate_pair(corners_x, corners_y, rule, weights, separation, block):
    """Integrate over two elements that do not touch, halving them where they are close."""
    stack_x = np.empty((4 * MOST_HALVINGS, 3, 3))
    stack_y = np.empty((4 * MOST_HALVINGS, 3, 3))
    depth = np.zeros(4 * MOST_HALVINGS, dtype=np.int64)
    count = len(weights)
    x, y = np.empty((count, 3)), np.empty((count, 3))
    phi, psi = np.empty((count, SHAPES)), np.empty((count, SHAPES))
    dx, dy = np.empty(count), np.empty(count)
    stack_x[0] = np.eye(3)
    stack_y[0] = np.eye(3)
    top = 1
    while top > 0:
        top -= 1
        bx, by, level = stack_x[top].copy(), stack_y[top].copy(), depth[top]
        centre_x, reach_x = centre_and_reach(corners_x, bx, False)
        centre_y, reach_y = centre_and_reach(corners_y, by, False)
        gap = np.sqrt(np.sum((centre_x - centre_y) ** 2)) - reach_x - reach_y
        if gap < separation * 2.0 * max(reach_x, reach_y) and level < MOST_HALVINGS:
            for k in range(4):
                if reach_x >= reach_y:
                    quarter(bx, k, stack_x[top])
                    stack_y[top] = by
                else:
                    stack_x[top] = bx
                    quarter(by, k, stack_y[top])
                depth[top] = level + 1
                top += 1
            continue
        _points_on(corners_x, rule @ bx, x, phi, dx)
        _points_on(corners_y, rule @ by, y, psi, dy)
        weight_x, weight_y = share_of_area(bx) * dx * weights, share_of_area(by) * dy * weights
        _add_point_pairs(x, phi, weight_x, y, psi, weight_y, block)


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
def _assemble_self(corners, dofs, shared, order_x, order_y, rules, rule, weights, separation):
    n = 3 * (dofs.max() + 1)
    matrix = np.zeros((n, n))
    scale = RADIUS**4 / (8.0 * np.pi)
    largest = max(len(rules[0][2]), len(rules[1][2]), len(rules[2][2]))
    x, y = np.empty((largest, 3)), np.empty((largest, 3))
    phi, psi = np.empty((largest, SHAPES)), np.empty((largest, SHAPES))
    dx, dy = np.empty(largest), np.empty(largest)
    for e in range(len(corners)):
        for f in range(e + 1):
            block = np.zeros((SHAPES, SHAPES, 6))
            common = shared[e, f]
            if common == 0:
                _add_separate_pair(corners[e], corners[f], rule, weights, separation, block)
            else:
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
    return matrix


def self_interaction(
    mesh: SphereMesh, singular: int = 6, regular: int = 5, separation: float = 1.0
):
    """Single-layer matrix of one sphere, (3n, 3n), symmetric; row 3a + i is node a, direction i.

    singular: Gauss points a direction where elements touch; regular: those where they do not;
    separation: pairs closer than this many of their widths are subdivided.
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
    barycentric, weights = triangle_rule(regular)
    rules = tuple(touching_pair_rule(k, singular) for k in (1, 2, 3))
    corners = mesh.vertices[triangles]
    return _assemble_self(
        corners,
        mesh.quadratic_nodes,
        shared,
        order_x,
        order_y,
        rules,
        barycentric,
        weights,
        separation,
    )


@njit(cache=True)
def _facing_points(shift, corners, dofs, rule, weights, separation):
    """Quadrature points on one sphere, dense where the surface of another is close.

    shift: centre of the other sphere seen from this one [d_p]. separation: as in `parts_facing`.
    Returns part by part: points (k, q, 3) [d_p], weighted shape functions (k, q, 6) and the
    numbers of the six nodes (k, 6).
    """
    count, elements = len(weights), len(corners)
    parts = np.empty((MOST_PARTS, 3, 3))
    ends = np.empty(elements, dtype=np.int64)
    total = 0
    for e in range(elements):
        total += parts_facing(shift / RADIUS, 1.0, corners[e], False, separation, parts)
        ends[e] = total
    points = np.empty((total, count, 3))
    shape = np.empty((total, count, SHAPES))
    nodes = np.empty((total, SHAPES), dtype=np.int64)
    density = np.empty(count)
    for e in range(elements):
        own = parts_facing(shift / RADIUS, 1.0, corners[e], False, separation, parts)
        for part in range(own):
            k = ends[e] - own + part
            _points_on(corners[e], rule @ parts[part], points[k], shape[k], density)
            scale = share_of_area(parts[part]) * RADIUS**2
            for q in range(count):
                shape[k, q] *= scale * density[q] * weights[q]
            nodes[k] = dofs[e]
    return RADIUS * points, shape, nodes


@njit(cache=True, fastmath={"contract"})
def _add_velocity(target, y, psi, nodes, velocity):
    """velocity[b] += G(target - y) psi_b(y) summed over all points: 6 entries for each node b.

    The points come leaf by leaf: sums over a leaf stay in registers, and only its six nodes are
    written, which halves the time of this loop, the hottest of a near pair.
    """
    count = y.shape[1]
    g, leaf = np.empty((count, 6)), np.empty((SHAPES, 6))
    for k in range(len(y)):
        for q in range(count):
            stokeslet(target[0] - y[k, q, 0], target[1] - y[k, q, 1], target[2] - y[k, q, 2], g[q])
        leaf[:] = 0.0
        for q in range(count):
            for b in range(SHAPES):
                for c in range(6):
                    leaf[b, c] += psi[k, q, b] * g[q, c]
        for b in range(SHAPES):
            for c in range(6):
                velocity[nodes[k, b], c] += leaf[b, c]


@njit(cache=True, fastmath={"contract"})
def _assemble_cross(shift, x, phi, nodes_x, y, psi, nodes_y):
    n, m = nodes_x.max() + 1, nodes_y.max() + 1
    entries = np.zeros((n, m, 6))
    velocity = np.empty((m, 6))
    for k in range(len(x)):
        for p in range(x.shape[1]):
            velocity[:] = 0.0
            _add_velocity(shift + x[k, p], y, psi, nodes_y, velocity)
            for a in range(SHAPES):
                factor = phi[k, p, a] / (8.0 * np.pi)
                for b in range(m):
                    for c in range(6):
                        entries[nodes_x[k, a], b, c] += factor * velocity[b, c]
    matrix = np.empty((3 * n, 3 * m))
    for a in range(n):
        for b in range(m):
            put_block(matrix, a, b, entries[a, b])
    return matrix


def cross_interaction(shift, mesh_x: SphereMesh, mesh_y: SphereMesh, regular=4, separation=0.5):
    """Velocity on one sphere by the traction on another, (3n, 3m); shift = centre x - centre y.

    regular: Gauss points a direction; separation: an element is quartered until this many of its
    widths fit between it and the other sphere. Points are then as far from every point of the
    other sphere as their sub-element is wide, so one set of points a sphere serves all elements
    of the other, and the cost of a narrow gap adds up instead of multiplying.
    """
    barycentric, weights = triangle_rule(regular)
    shift = np.asarray(shift, dtype=float)
    x, y = (
        _facing_points(
            toward,
            mesh.vertices[mesh.triangles],
            mesh.quadratic_nodes,
            barycentric,
            weights,
            separation,
        )
        for toward, mesh in ((-shift, mesh_x), (shift, mesh_y))
    )
    return _assemble_cross(shift, *x, *y)


def nodal_integrals(mesh: SphereMesh, values, rule: int = 8) -> np.ndarray:
    """Integrals of phi_a g over the sphere, (n_nodes, k); values maps unit vectors to (..., k)."""
    position, shape, weights = element_points(mesh, rule)
    samples = values(position.reshape(-1, 3)).reshape(*weights.shape, -1)
    element = RADIUS**2 * np.einsum("eq,qa,eqk->eak", weights, shape, samples)
    dofs = mesh.quadratic_nodes
    out = np.zeros((dofs.max() + 1, element.shape[2]))
    np.add.at(out, dofs, element)
    return out
