"""Collocation at the centroids of elements with constant traction: the discretisation of the paper.

Lengths are in radii of the sphere that carries the source elements. An integral of a kernel over an
element takes as many Gauss points as its distance from the target asks for; an element too close
for the largest rule is cut into parts that are not.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.polynomial.legendre import leggauss

from dustfall.stokes.elements.element import (
    MOST_PARTS,
    centre_and_reach,
    parts_facing,
    place_points,
    share_of_area,
)
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.quadrature import triangle_rule
from dustfall.stokes.elements.stokeslet import put_block, stokeslet

MOST_POINTS = 6
"""Gauss points a direction beyond which an element is cut instead."""

SINGULAR_POINTS = 20
"""Points a direction in each third of the element that holds the target itself."""


class Elements(NamedTuple):
    """The elements of one sphere with all that their integrals need.

    corners: (e, 3, 3). flat: elements are flat, not projected. centre: (e, 3) centroids, where the
    equation holds. normal: (e, 3) outward at the centroid. area: (e,); vector_area: (e, 3),
    integral of the normal. reach: (e,) from the
    centroid to the farthest corner. far: distance, in reaches, from which 1, 2, ... points a
    direction are enough; rules: their barycentric points and weights; points, weights: the same
    on every element. singular_points, singular_weights: for the target on the element itself.
    """

    corners: np.ndarray
    flat: bool
    centre: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    vector_area: np.ndarray
    reach: np.ndarray
    far: np.ndarray
    rules: tuple
    points: tuple
    weights: tuple
    singular_points: np.ndarray
    singular_weights: np.ndarray


def elements_of(mesh: SphereMesh, flat: bool, tolerance: float) -> Elements:
    """Prepare a mesh; tolerance: relative error of an integral over one element.

    A rule of n points integrates a kernel whose pole is at the distance d from an interval of
    half-width a with an error of about (d/a + sqrt(1 + (d/a)^2))^(-2 n) (Bernstein ellipse).
    """
    corners = mesh.vertices[mesh.triangles]
    counts = np.arange(1, MOST_POINTS + 1)
    rules = tuple(triangle_rule(int(n)) for n in counts)
    singular_points, singular_weights = _on_every_element(corners, flat, *_singular_rule())
    area = singular_weights.sum(axis=1)
    # On the unit sphere the normal is the position.
    facing = np.einsum("eq,eqk->ek", singular_weights, singular_points)
    placed = [_on_every_element(corners, flat, *rule) for rule in rules]
    far = np.sinh(np.log(1.0 / tolerance) / (2.0 * counts))
    # However far the target, a projected element needs points enough for its own area.
    missed = [np.abs(w.sum(axis=1) / area - 1.0).max() for _, w in placed[:-1]]
    far[:-1][np.array(missed) > tolerance] = np.inf
    size = [centre_and_reach(c, np.eye(3), flat) for c in corners]
    centre = np.array([c for c, _ in size])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True) if flat else centre
    return Elements(
        corners=corners,
        flat=flat,
        centre=centre,
        normal=normal,
        area=area,
        vector_area=area[:, None] * normal if flat else facing,
        reach=np.array([r for _, r in size]),
        far=far,
        rules=rules,
        points=tuple(p for p, _ in placed),
        weights=tuple(w for _, w in placed),
        singular_points=singular_points,
        singular_weights=singular_weights,
    )


def _on_every_element(corners, flat, barycentric, weights):
    """Points (e, q, 3) and weights (e, q) of a rule on every element."""
    points = np.empty((len(corners), len(weights), 3))
    density = np.empty((len(corners), len(weights)))
    for e, own in enumerate(corners):
        place_points(own, barycentric, flat, points[e], density[e])
    return points, density * weights


def _singular_rule():
    """Duffy's rule (1982) for a 1/r singularity at the centroid: three triangles around it."""
    t, w = leggauss(SINGULAR_POINTS)
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


@njit(cache=True)
def _sufficient_rule(target, e, elements):
    """Number of the smallest rule fit for a target off element e; MOST_POINTS if none is."""
    d = 0.0
    for k in range(3):
        d += (target[k] - elements.centre[e, k]) ** 2
    distance = np.sqrt(d) - elements.reach[e]
    number = 0
    while number < MOST_POINTS and distance < elements.far[number] * elements.reach[e]:
        number += 1
    return number


@njit(cache=True)
def _crowded_points(target, corners, elements, parts):
    """Points, their barycentric coordinates and weights, denser towards a target close by.

    Shapes (1, q, 3), (q, 3) and (1, q), as if of one element.
    """
    rule, rule_weights = elements.rules[MOST_POINTS - 1]
    n = len(rule_weights)
    # Parts then lie, in half-widths, as far away as the largest rule asks for.
    separation = 0.5 * (elements.far[MOST_POINTS - 1] + 1.0)
    count = parts_facing(target, corners, elements.flat, separation, parts)
    points, barycentric = np.empty((1, count * n, 3)), np.empty((count * n, 3))
    weights = np.empty((1, count * n))
    for k in range(count):
        own = slice(k * n, (k + 1) * n)
        barycentric[own] = rule @ parts[k]
        place_points(corners, barycentric[own], elements.flat, points[0, own], weights[0, own])
        weights[0, own] *= share_of_area(parts[k]) * rule_weights
    return points, barycentric, weights


@njit(cache=True, fastmath={"contract"})
def _add_stokeslets(target, points, weights, e, scratch, entry):
    for q in range(weights.shape[1]):
        dx, dy, dz = (
            target[0] - points[e, q, 0],
            target[1] - points[e, q, 1],
            target[2] - points[e, q, 2],
        )
        stokeslet(dx, dy, dz, scratch)
        weight = weights[e, q] / (8.0 * np.pi)
        for k in range(6):
            entry[k] += weight * scratch[k]


@njit(cache=True)
def single_layer(targets, own, elements):
    """(1 / 8 pi) integral of G over each element, at each target: (3t, 3e).

    targets: (t, 3). own: target k is the centroid of element k. One row of 3 x 3 blocks a target.
    """
    count = len(elements.area)
    matrix = np.empty((3 * len(targets), 3 * count))
    parts = np.empty((MOST_PARTS, 3, 3))
    g, entry = np.empty(6), np.empty(6)
    for t in range(len(targets)):
        target = targets[t]
        for e in range(count):
            entry[:] = 0.0
            rule = _sufficient_rule(target, e, elements)
            if own and e == t:
                points, weights = elements.singular_points, elements.singular_weights
                _add_stokeslets(target, points, weights, e, g, entry)
            elif rule < MOST_POINTS:
                _add_stokeslets(target, elements.points[rule], elements.weights[rule], e, g, entry)
            else:
                points, _, weights = _crowded_points(target, elements.corners[e], elements, parts)
                _add_stokeslets(target, points, weights, 0, g, entry)
            put_block(matrix, t, e, entry)
    return matrix


@njit(cache=True, fastmath={"contract"})
def _add_stresslets(target, points, barycentric, weights, e, normal, velocity, out):
    for q in range(weights.shape[1]):
        r = (points[e, q, 0] - target[0], points[e, q, 1] - target[1], points[e, q, 2] - target[2])
        r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
        flux, along = 0.0, 0.0
        for i in range(3):
            u = 0.0
            for k in range(3):
                u += barycentric[q, k] * velocity[k, i]
            flux += u * r[i]
            along += normal[i] * r[i]
        factor = -6.0 / (8.0 * np.pi) * weights[e, q] * flux * along / (r2 * r2 * np.sqrt(r2))
        for i in range(3):
            out[i] += factor * r[i]


@njit(cache=True)
def double_layer(targets, own, elements, velocity):
    """(1 / 8 pi) integral of u_i T_ijk n_k, principal value, at each target: (t, 3).

    velocity: (e, 3, 3) at the corners of each element, in between linear. The elements are flat, n
    points away from the sphere's centre, T_ijk = -6 r_i r_j r_k / r^5 with r from the target
    (paper, appendix A). The element that holds the target contributes nothing, as r is normal to n.
    """
    out = np.zeros((len(targets), 3))
    parts = np.empty((MOST_PARTS, 3, 3))
    for e in range(len(elements.area)):
        u, normal = velocity[e], elements.normal[e]
        if not u.any():
            continue
        for t in range(len(targets)):
            if own and e == t:
                continue
            target = targets[t]
            rule = _sufficient_rule(target, e, elements)
            if rule < MOST_POINTS:
                _add_stresslets(
                    target, elements.points[rule], elements.rules[rule][0],
                    elements.weights[rule], e, normal, u, out[t],
                )  # fmt: skip
            else:
                points, barycentric, weights = _crowded_points(
                    target, elements.corners[e], elements, parts
                )
                _add_stresslets(target, points, barycentric, weights, 0, normal, u, out[t])
    return out
