"""Galerkin coupling of two surfaces: each pair of elements that do not touch integrated in full.

The inner integral, over a source element seen from one point, takes as many points as their
distance asks for, and the element is quartered where no rule is enough. So does the outer one, over
the target's elements, but up to a bound: what a smooth traction on one sphere induces on the other
is smooth however narrow the gap. Lengths are in radii.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from dustfall.stokes.elements.element import (
    MOST_HALVINGS,
    SHAPES,
    centre_and_reach,
    place_points,
    quarter,
    shape_functions,
)
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.quadrature import triangle_rule
from dustfall.stokes.elements.stokeslet import put_block
from dustfall.units import RADIUS

FEWEST_POINTS, MOST_POINTS = 2, 8
"""Gauss points a direction of the inner rules: quadratic shapes need two; beyond eight quartering
an element is cheaper."""


class Side(NamedTuple):
    """One sphere of a pair with the quadrature that a tolerance asks for.

    corners: (e, 3, 3). nodes: (e, 6). unknowns: number of nodes. centre: (e, 3); reach: (e,), from
    it to the farthest corner. far: distance, in reaches, from which each rule is enough. fewest:
    (e,), number of the smallest rule that integrates the shape functions of the element. rules,
    weights: the rules. points: by rule, (e, 3, q); shapes: by rule, (e, 6, q), shape functions
    times weights. outer: number of the largest rule for the outer integral.
    """

    corners: np.ndarray
    nodes: np.ndarray
    unknowns: int
    centre: np.ndarray
    reach: np.ndarray
    far: np.ndarray
    fewest: np.ndarray
    rules: tuple
    weights: tuple
    points: tuple
    shapes: tuple
    outer: int


def side(mesh: SphereMesh, tolerance: float) -> Side:
    """Prepare a sphere as target and source; tolerance: relative error of an integral.

    A rule of n points integrates a kernel whose pole is at the distance d from an interval of
    half-width a with an error of about (d/a + sqrt(1 + (d/a)^2))^(-2 n) (Bernstein ellipse).
    """
    corners = mesh.vertices[mesh.triangles]
    size = [centre_and_reach(c, np.eye(3), False) for c in corners]
    counts = np.arange(FEWEST_POINTS, MOST_POINTS + 1)
    rules, weights = zip(*[triangle_rule(int(n)) for n in counts], strict=True)
    placed = [_on_elements(corners, *r) for r in zip(rules, weights, strict=True)]
    points, shapes = zip(*placed, strict=True)
    moments = np.array([shape.sum(axis=2) for shape in shapes])
    missed = np.abs(moments - moments[-1]).max(axis=2) / moments[-1].sum(axis=1)
    return Side(
        corners=corners,
        nodes=mesh.quadratic_nodes,
        unknowns=int(mesh.quadratic_nodes.max()) + 1,
        centre=np.array([c for c, _ in size]),
        reach=np.array([r for _, r in size]),
        far=np.sinh(np.log(1.0 / tolerance) / (2.0 * counts)),
        # However far the target, a projected element needs points enough for its own area.
        fewest=np.argmax(missed <= tolerance, axis=0),
        rules=rules,
        weights=weights,
        points=points,
        shapes=shapes,
        outer=_most_outer_points(tolerance) - FEWEST_POINTS,
    )


def _most_outer_points(tolerance: float) -> int:
    """Gauss points a direction of the outer integral where elements are close.

    Measured on pairs at gaps of 0.01 and 0.1 radii: 4 points leave 1e-6, 5 leave 1e-7.
    """
    return int(np.clip(np.ceil(-np.log10(tolerance) - 2.0), 3, MOST_POINTS))


@njit(cache=True)
def _on_elements(corners, rule, weights):
    """Points (e, 3, q) of a rule on each element, and shape functions times weights (e, 6, q)."""
    count = len(weights)
    points = np.empty((len(corners), 3, count))
    shapes = np.empty((len(corners), SHAPES, count))
    position, density, shape = np.empty((count, 3)), np.empty(count), np.empty(SHAPES)
    for e in range(len(corners)):
        place_points(corners[e], rule, False, position, density)
        for q in range(count):
            shape_functions(rule[q, 0], rule[q, 1], rule[q, 2], shape)
            for k in range(3):
                points[e, k, q] = position[q, k]
            for a in range(SHAPES):
                shapes[e, a, q] = shape[a] * density[q] * weights[q]
    return points, shapes


@njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
def _add_element(x, y, z, points, shapes, count, g, block):
    """block[b] += sum over points of G(target - point) shapes[b, point], six entries each.

    Sums are vectorised, so their order is the compiler's; it is the same in every run.
    """
    for q in range(count):
        dx, dy, dz = x - points[0, q], y - points[1, q], z - points[2, q]
        inverse = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
        cube = inverse * inverse * inverse
        g[0, q] = inverse + dx * dx * cube
        g[1, q] = dx * dy * cube
        g[2, q] = dx * dz * cube
        g[3, q] = inverse + dy * dy * cube
        g[4, q] = dy * dz * cube
        g[5, q] = inverse + dz * dz * cube
    for b in range(SHAPES):
        xx = xy = xz = yy = yz = zz = 0.0
        for q in range(count):
            s = shapes[b, q]
            xx += s * g[0, q]
            xy += s * g[1, q]
            xz += s * g[2, q]
            yy += s * g[3, q]
            yz += s * g[4, q]
            zz += s * g[5, q]
        block[b, 0] += xx
        block[b, 1] += xy
        block[b, 2] += xz
        block[b, 3] += yy
        block[b, 4] += yz
        block[b, 5] += zz


@njit(cache=True, inline="always")
def _sufficient_rule(distance, reach, far, fewest):
    """Number of the smallest rule fit for a target this far away; len(far) if none is."""
    number = fewest
    while number < len(far) and distance - reach < far[number] * reach:
        number += 1
    return number


@njit(cache=True)
def _part_size(corners, part, x, y, z, own):
    """Distance of a target from the centroid of a part, and from that to the farthest corner."""
    cx = cy = cz = 0.0
    for k in range(3):
        for i in range(3):
            own[k, i] = (
                part[k, 0] * corners[0, i] + part[k, 1] * corners[1, i] + part[k, 2] * corners[2, i]
            )
        r = np.sqrt(own[k, 0] ** 2 + own[k, 1] ** 2 + own[k, 2] ** 2)
        own[k] /= r
        cx += own[k, 0]
        cy += own[k, 1]
        cz += own[k, 2]
    r = np.sqrt(cx * cx + cy * cy + cz * cz)
    cx, cy, cz = cx / r, cy / r, cz / r
    reach = 0.0
    for k in range(3):
        reach = max(reach, (own[k, 0] - cx) ** 2 + (own[k, 1] - cy) ** 2 + (own[k, 2] - cz) ** 2)
    distance = np.sqrt((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2)
    return distance, np.sqrt(reach)


@njit(cache=True)
def _place_part(corners, part, share, rule, weights, points, shapes):
    """Points (3, q) of a rule on a part of an element, and shape functions times weights."""
    a, b, c = corners
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    for q in range(len(weights)):
        l0 = rule[q, 0] * part[0, 0] + rule[q, 1] * part[1, 0] + rule[q, 2] * part[2, 0]
        l1 = rule[q, 0] * part[0, 1] + rule[q, 1] * part[1, 1] + rule[q, 2] * part[2, 1]
        l2 = 1.0 - l0 - l1
        x = l0 * a[0] + l1 * b[0] + l2 * c[0]
        y = l0 * a[1] + l1 * b[1] + l2 * c[1]
        z = l0 * a[2] + l1 * b[2] + l2 * c[2]
        inverse = 1.0 / np.sqrt(x * x + y * y + z * z)
        points[0, q], points[1, q], points[2, q] = x * inverse, y * inverse, z * inverse
        w = 0.5 * triple * share * weights[q] * inverse * inverse * inverse
        shapes[0, q] = w * l0 * (2.0 * l0 - 1.0)
        shapes[1, q] = w * l1 * (2.0 * l1 - 1.0)
        shapes[2, q] = w * l2 * (2.0 * l2 - 1.0)
        shapes[3, q] = w * 4.0 * l0 * l1
        shapes[4, q] = w * 4.0 * l1 * l2
        shapes[5, q] = w * 4.0 * l2 * l0


@njit(cache=True)
def _couple(target, source, shift, skip):
    """Six entries of G for each pair of nodes, (n, m, 6); shift: centre target - centre source."""
    entries = np.zeros((target.unknowns, source.unknowns, 6))
    last = len(source.far) - 1
    most = len(source.weights[last])
    g, points, shapes = np.empty((6, most)), np.empty((3, most)), np.empty((SHAPES, most))
    stack = np.empty((3 * MOST_HALVINGS + 4, 3, 3))
    level = np.zeros(len(stack), dtype=np.int64)
    own, whole = np.empty((3, 3)), np.eye(3)
    inner, block = np.empty((SHAPES, 6)), np.empty((SHAPES, SHAPES, 6))
    for e in range(len(target.corners)):
        for f in range(len(source.corners)):
            if skip[e, f]:
                continue
            block[:] = 0.0
            x = target.centre[e, 0] + shift[0] - source.centre[f, 0]
            y = target.centre[e, 1] + shift[1] - source.centre[f, 1]
            z = target.centre[e, 2] + shift[2] - source.centre[f, 2]
            distance = np.sqrt(x * x + y * y + z * z) - source.reach[f]
            outer = min(
                target.outer,
                _sufficient_rule(distance, target.reach[e], target.far, target.fewest[e]),
            )
            outer_points, outer_shapes = target.points[outer][e], target.shapes[outer][e]
            for p in range(outer_points.shape[1]):
                x = outer_points[0, p] + shift[0]
                y = outer_points[1, p] + shift[1]
                z = outer_points[2, p] + shift[2]
                inner[:] = 0.0
                distance = np.sqrt(
                    (x - source.centre[f, 0]) ** 2
                    + (y - source.centre[f, 1]) ** 2
                    + (z - source.centre[f, 2]) ** 2
                )
                rule = _sufficient_rule(distance, source.reach[f], source.far, source.fewest[f])
                if rule <= last:
                    own_points, own_shapes = source.points[rule][f], source.shapes[rule][f]
                    _add_element(x, y, z, own_points, own_shapes, own_points.shape[1], g, inner)
                else:
                    stack[0], level[0], top = whole, 0, 1
                    while top > 0:
                        top -= 1
                        part, depth = stack[top].copy(), level[top]
                        distance, reach = _part_size(source.corners[f], part, x, y, z, own)
                        rule = _sufficient_rule(distance, reach, source.far, 0)
                        if rule <= last:
                            weights = source.weights[rule]
                            _place_part(
                                source.corners[f], part, 0.25**depth, source.rules[rule],
                                weights, points, shapes,
                            )  # fmt: skip
                            _add_element(x, y, z, points, shapes, len(weights), g, inner)
                            continue
                        if depth == MOST_HALVINGS:
                            raise ValueError("gap too narrow: an element was quartered too often")
                        for k in range(4):
                            quarter(part, k, stack[top])
                            level[top] = depth + 1
                            top += 1
                for a in range(SHAPES):
                    factor = outer_shapes[a, p]
                    for b in range(SHAPES):
                        for k in range(6):
                            block[a, b, k] += factor * inner[b, k]
            for a in range(SHAPES):
                for b in range(SHAPES):
                    for k in range(6):
                        entries[target.nodes[e, a], source.nodes[f, b], k] += block[a, b, k]
    return entries


@njit(cache=True)
def _as_matrix(entries, scale):
    n, m = entries.shape[:2]
    matrix = np.empty((3 * n, 3 * m))
    for a in range(n):
        for b in range(m):
            put_block(matrix, a, b, scale * entries[a, b])
    return matrix


def coupling(target: Side, source: Side, shift, skip=None) -> np.ndarray:
    """Velocity on one sphere by the traction on another, (3n, 3m), tested with shape functions.

    shift: (3,) centre of the target seen from that of the source [d_p]; mu = 1. skip: (e, f), pairs
    of elements that are left out, as those that touch must be.
    Raises ValueError if the gap is below what quartering an element can resolve.
    """
    if skip is None:
        skip = np.zeros((len(target.corners), len(source.corners)), dtype=np.bool_)
    shift = np.asarray(shift, dtype=float) / RADIUS
    # Two areas and one 1/r.
    return _as_matrix(_couple(target, source, shift, skip), RADIUS**3 / (8.0 * np.pi))
