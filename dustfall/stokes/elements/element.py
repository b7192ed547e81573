"""One element of the unit sphere: its points, its size, and its parts near a target.

An element is a triangle with its corners on the unit sphere. It is taken flat, as gmsh makes it, or
projected radially onto the sphere. A part of an element is given by the barycentric coordinates of
its three corners.
"""

import numpy as np
from numba import njit

MOST_HALVINGS = 16
"""How often an element is halved at most: to 1/65,536 of its width."""

MOST_PARTS = 65536
"""Parts that one element is cut into at most."""


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
def place_points(corners, barycentric, flat, position, density):
    """Write the points (q, 3) of an element and its area per unit of quadrature weight (q,)."""
    a, b, c = corners
    triple = (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    area = 0.5 * np.sqrt(np.sum(np.cross(b - a, c - a) ** 2)) if flat else 0.0
    for q in range(len(barycentric)):
        l0, l1, l2 = barycentric[q]
        x = l0 * a[0] + l1 * b[0] + l2 * c[0]
        y = l0 * a[1] + l1 * b[1] + l2 * c[1]
        z = l0 * a[2] + l1 * b[2] + l2 * c[2]
        r = 1.0 if flat else np.sqrt(x * x + y * y + z * z)
        position[q, 0] = x / r
        position[q, 1] = y / r
        position[q, 2] = z / r
        # Solid angle per area of the flat element: its plane is triple / (2 area) from the origin.
        density[q] = area if flat else 0.5 * triple / (r * r * r)


@njit(cache=True)
def centre_and_reach(corners, part, flat):
    """Centroid of a part of an element and the largest distance from it to a corner."""
    own = part @ corners
    centre = np.zeros(3)
    for k in range(3):
        if not flat:
            own[k] /= np.sqrt(np.sum(own[k] ** 2))
        centre += own[k] / 3.0
    if not flat:
        centre /= np.sqrt(np.sum(centre**2))
    reach = 0.0
    for k in range(3):
        reach = max(reach, np.sum((own[k] - centre) ** 2))
    return centre, np.sqrt(reach)


@njit(cache=True)
def share_of_area(part):
    """Area of a part over the area of its element, both flat."""
    return abs(np.linalg.det(part))


@njit(cache=True)
def quarter(part, k, out):
    """Write quarter k of the four that halve the sides of a part."""
    if k == 3:
        for i in range(3):
            out[i] = 0.5 * (part[(i + 1) % 3] + part[(i + 2) % 3])
    else:
        for i in range(3):
            out[i] = 0.5 * (part[i] + part[k])


@njit(cache=True)
def parts_facing(target, corners, flat, separation, parts):
    """Cut an element until every part is at least `separation` of its widths from a target.

    target: (3,), in radii of the element's sphere and seen from its centre. Writes barycentric
    corners to parts (k, 3, 3); returns their number. Raises ValueError where they do not fit.
    """
    stack = np.empty((3 * MOST_HALVINGS + 4, 3, 3))
    level = np.zeros(len(stack), dtype=np.int64)
    stack[0] = np.eye(3)
    top, count = 1, 0
    while top > 0:
        top -= 1
        part, depth = stack[top].copy(), level[top]
        centre, reach = centre_and_reach(corners, part, flat)
        distance = np.sqrt(np.sum((target - centre) ** 2))
        if distance < separation * 2.0 * reach:
            if depth == MOST_HALVINGS or count + top + 4 > len(parts):
                raise ValueError("target too close to an element: it was quartered too often")
            for k in range(4):
                quarter(part, k, stack[top])
                level[top] = depth + 1
                top += 1
        else:
            parts[count] = part
            count += 1
    return count
