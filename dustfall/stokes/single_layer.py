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

from dustfall.stokes.mesh import SphereMesh
from dustfall.stokes.quadrature import touching_pair_rule, triangle_rule

RADIUS = 0.5
"""Radius of every sphere [d_p]."""

SHAPES = 6
"""Quadratic shape functions on an element: three vertices, then edges 01, 12, 20."""


def dof_numbers(mesh: SphereMesh) -> np.ndarray:
    """(n_triangles, 6) number of the node behind each local shape function: vertices, edges."""
    edges = mesh.edges
    number = {tuple(edge): len(mesh.vertices) + k for k, edge in enumerate(edges.tolist())}
    t = mesh.triangles
    sides = [np.sort(t[:, pair], axis=1).tolist() for pair in ([0, 1], [1, 2], [2, 0])]
    midpoints = [[number[tuple(side)] for side in column] for column in sides]
    return np.column_stack([t, *midpoints])


@njit(cache=True, inline="always")
def _shape_functions(l0, l1, l2, out):
    out[0] = l0 * (2.0 * l0 - 1.0)
    out[1] = l1 * (2.0 * l1 - 1.0)
    out[2] = l2 * (2.0 * l2 - 1.0)
    out[3] = 4.0 * l0 * l1
    out[4] = 4.0 * l1 * l2
    out[5] = 4.0 * l2 * l0


@njit(cache=True)
def _points_on(corners, barycentric, position, shape, density):
    """Project barycentric points of one element: unit vectors, shape functions, dS per weight."""
    a, b, c = corners
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    for q in range(len(barycentric)):
        l0, l1, l2 = barycentric[q]
        x = l0 * a[0] + l1 * b[0] + l2 * c[0]
        y = l0 * a[1] + l1 * b[1] + l2 * c[1]
        z = l0 * a[2] + l1 * b[2] + l2 * c[2]
        r = np.sqrt(x * x + y * y + z * z)
        position[q, 0] = x / r
        position[q, 1] = y / r
        position[q, 2] = z / r
        # Solid angle per area of the flat element: its plane is triple / (2 area) from the origin.
        density[q] = 0.5 * triple / (r * r * r)
        _shape_functions(l0, l1, l2, shape[q])


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
def _add_point_pairs(shift, x, phi, wx, y, psi, wy, block):
    """block[a, b] += sum over points of wx phi_a(x) G(shift + RADIUS (x - y)) psi_b(y) wy."""
    g = np.empty(6)
    inner = np.empty((SHAPES, 6))
    for p in range(len(wx)):
        inner[:] = 0.0
        for q in range(len(wy)):
            stokeslet(
                shift[0] + RADIUS * (x[p, 0] - y[q, 0]),
                shift[1] + RADIUS * (x[p, 1] - y[q, 1]),
                shift[2] + RADIUS * (x[p, 2] - y[q, 2]),
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
def _centre_and_reach(corners):
    """Centroid of a projected element on the unit sphere and the largest distance to a corner."""
    centre = corners[0] + corners[1] + corners[2]
    centre /= np.sqrt(np.sum(centre**2))
    reach = 0.0
    for k in range(3):
        reach = max(reach, np.sum((corners[k] - centre) ** 2))
    return centre, np.sqrt(reach)


@njit(cache=True)
def _quarter(barycentric, k, out):
    """Sub-triangle k of the four that halve the sides; rows are barycentric corners."""
    if k == 3:
        for i in range(3):
            out[i] = 0.5 * (barycentric[(i + 1) % 3] + barycentric[(i + 2) % 3])
    else:
        for i in range(3):
            out[i] = 0.5 * (barycentric[i] + barycentric[k])


@njit(cache=True)
def _projected(corners, barycentric):
    """Corners on the unit sphere of a sub-triangle given in barycentric coordinates."""
    out = barycentric @ corners
    for k in range(3):
        out[k] /= np.sqrt(np.sum(out[k] ** 2))
    return out


_MOST_HALVINGS = 16


@njit(cache=True)
def _add_separate_pair(shift, corners_x, corners_y, rule, weights, separation, block):
    """Integrate over two elements that do not touch, halving them where they are close."""
    stack_x = np.empty((8 * _MOST_HALVINGS, 3, 3))
    stack_y = np.empty((8 * _MOST_HALVINGS, 3, 3))
    depth = np.zeros(8 * _MOST_HALVINGS, dtype=np.int64)
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
        centre_x, reach_x = _centre_and_reach(_projected(corners_x, bx))
        centre_y, reach_y = _centre_and_reach(_projected(corners_y, by))
        distance = np.sqrt(np.sum((shift + RADIUS * (centre_x - centre_y)) ** 2)) / RADIUS
        gap = distance - reach_x - reach_y
        if gap < separation * 2.0 * max(reach_x, reach_y) and level < _MOST_HALVINGS:
            for k in range(4):
                if reach_x >= reach_y:
                    _quarter(bx, k, stack_x[top])
                    stack_y[top] = by
                else:
                    stack_x[top] = bx
                    _quarter(by, k, stack_y[top])
                depth[top] = level + 1
                top += 1
            continue
        _points_on(corners_x, rule @ bx, x, phi, dx)
        _points_on(corners_y, rule @ by, y, psi, dy)
        # A sub-triangle covers this share of the flat element's area.
        share_x = abs(np.linalg.det(bx))
        share_y = abs(np.linalg.det(by))
        _add_point_pairs(
            shift, x, phi, share_x * dx * weights, y, psi, share_y * dy * weights, block
        )


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
    here = np.zeros(3)
    largest = max(len(rules[0][2]), len(rules[1][2]), len(rules[2][2]))
    x, y = np.empty((largest, 3)), np.empty((largest, 3))
    phi, psi = np.empty((largest, SHAPES)), np.empty((largest, SHAPES))
    dx, dy = np.empty(largest), np.empty(largest)
    for e in range(len(corners)):
        for f in range(e + 1):
            block = np.zeros((SHAPES, SHAPES, 6))
            common = shared[e, f]
            if common == 0:
                _add_separate_pair(here, corners[e], corners[f], rule, weights, separation, block)
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
        dof_numbers(mesh),
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

    shift: centre of the other sphere seen from this one [d_p]. An element is quartered until it is
    narrower than its distance from the other surface, divided by `separation`.
    Returns leaf by leaf: points (k, q, 3) [d_p], weighted shape functions (k, q, 6) and the
    numbers of the six nodes (k, 6).
    """
    count = len(weights)
    capacity = 4 * len(corners)
    leaf = np.empty((capacity, 3, 3))
    owner = np.empty(capacity, dtype=np.int64)
    leaves = 0
    stack = np.empty((4 * _MOST_HALVINGS, 3, 3))
    depth = np.empty(4 * _MOST_HALVINGS, dtype=np.int64)
    for e in range(len(corners)):
        stack[0] = np.eye(3)
        depth[0] = 0
        top = 1
        while top > 0:
            top -= 1
            sub, level = stack[top].copy(), depth[top]
            centre, reach = _centre_and_reach(_projected(corners[e], sub))
            distance = np.sqrt(np.sum((shift - RADIUS * centre) ** 2)) / RADIUS - 1.0
            if 2.0 * reach * separation > distance and level < _MOST_HALVINGS:
                for k in range(4):
                    _quarter(sub, k, stack[top])
                    depth[top] = level + 1
                    top += 1
                continue
            if leaves == capacity:
                capacity *= 2
                more_leaf, more_owner = np.empty((capacity, 3, 3)), np.empty(capacity, np.int64)
                more_leaf[:leaves], more_owner[:leaves] = leaf, owner
                leaf, owner = more_leaf, more_owner
            leaf[leaves], owner[leaves] = sub, e
            leaves += 1
    points = np.empty((leaves, count, 3))
    shape = np.empty((leaves, count, SHAPES))
    nodes = np.empty((leaves, SHAPES), dtype=np.int64)
    density = np.empty(count)
    for k in range(leaves):
        _points_on(corners[owner[k]], rule @ leaf[k], points[k], shape[k], density)
        # A sub-triangle covers this share of the flat element's area.
        share = abs(np.linalg.det(leaf[k]))
        for q in range(count):
            shape[k, q] *= share * density[q] * weights[q] * RADIUS**2
        nodes[k] = dofs[owner[k]]
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
            dof_numbers(mesh),
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
    dofs = dof_numbers(mesh)
    out = np.zeros((dofs.max() + 1, element.shape[2]))
    np.add.at(out, dofs, element)
    return out
