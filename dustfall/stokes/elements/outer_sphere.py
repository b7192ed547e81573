"""The formulation of the paper: particles within a large sphere on which the flow is given.

Full boundary integral equation (paper, appendix A): single layer of the unknown tractions, constant
on flat elements; double layer of the given velocities, linear on them; collocation at centroids.
On a smooth boundary, and at the centroid of a flat element, c = 4 pi:

    4 pi u_j = integral of u_i T_ijk n_k - 1/mu integral of G_ji q_i,   n into the fluid.

It serves the mesh study and the benchmark: free space needs neither the outer sphere nor, as the
particles are rigid, the double layer.
"""

from functools import cache

import numpy as np

from dustfall.solution import Solution, Status
from dustfall.spheres import (
    checked_centres,
    checked_flow,
    checked_scene,
    checked_tolerance,
    flow_direction,
)
from dustfall.stokes.elements.boundary_elements import (
    MOST_ITERATIONS,
    ConstantCollocation,
    one_body_operator,
    solve_blocks,
)
from dustfall.stokes.elements.collocation import double_layer, single_layer
from dustfall.stokes.elements.mesh import SphereMesh, sphere_mesh
from dustfall.units import CONTACT, FORCE_UNIT, RADIUS, STOKES_DRAG

PAPER_RATIO = 1024.0
"""Diameter of the outer sphere over that of the cluster of particles in the paper."""


SIZES = ((0.65, 1.0), (0.5, 0.7))
"""Edge lengths [radii] of the particles and of the outer sphere, on the coarse and the fine mesh of
a scene: 80 and 154 elements a particle."""

MARGIN = 1.5
"""Gaps and the outer mesh do not keep to the law of the mean element."""

RESIDUAL = 1e-4
"""Relative residual that GMRES is asked for, far below what flat elements are worth."""


def forces_in_outer_sphere(
    centres,
    mesh: SphereMesh,
    outer_mesh: SphereMesh,
    flow=(0.0, 1.0, 0.0),
    ratio: float = PAPER_RATIO,
    velocities=None,
    tolerance: float = RESIDUAL,
) -> np.ndarray:
    """Force on each of n equal spheres inside a sphere on which the flow is uniform.

    centres: (n, 3) [d_p]; the outer sphere is centred on the first, the reference particle.
    mesh, outer_mesh: of every particle and of the outer sphere. flow: (3,), velocity on the outer
    sphere, whose magnitude makes forces dimensionless. ratio: outer diameter over that of the
    cluster, the smallest ball about the reference particle that holds all particles; above 1.
    velocities: (n, 3) at which the particles translate, in the unit of flow; at rest by default.
    tolerance: relative error of the quadrature and residual of GMRES.
    Returns (n, 3) in Re_p c_D. Raises ValueError for wrong shapes, overlaps or a ratio not above 1.
    """
    centres, flow = checked_centres(centres), checked_flow(flow)
    speed = np.linalg.norm(flow)
    if speed == 0.0:
        raise ValueError("flow must not be zero: it makes the forces dimensionless")
    if not 1.0 < ratio < np.inf:
        raise ValueError(f"ratio {ratio}: the outer sphere must be larger than the cluster")
    velocities = np.zeros_like(centres) if velocities is None else np.asarray(velocities, float)
    if velocities.shape != centres.shape:
        raise ValueError(f"velocities must have the shape {centres.shape}, not {velocities.shape}")

    cluster = np.linalg.norm(centres - centres[0], axis=1).max() + RADIUS
    particle = ConstantCollocation(mesh, tolerance, flat=True)
    outer = ConstantCollocation(outer_mesh, tolerance, flat=True)
    surfaces = [particle] * len(centres) + [outer]
    middles = np.vstack([centres, centres[:1]])
    radii = np.append(np.full(len(centres), RADIUS), ratio * cluster)
    moving = np.vstack([velocities, flow]) / speed

    def seen(i, j):
        """Collocation points of surface i in radii of surface j, from its centre."""
        return (middles[i] + radii[i] * surfaces[i].elements.centre - middles[j]) / radii[j]

    numbers = range(len(surfaces))
    blocks, right = {}, []
    for i in numbers:
        load = np.tile(-0.5 * moving[i], (surfaces[i].unknowns, 1))
        for j in numbers:
            elements = surfaces[j].elements
            # Normals of a particle point into the fluid, those of the outer sphere out of it.
            sign = -1.0 if surfaces[j] is outer else 1.0
            corner_velocity = np.broadcast_to(sign * moving[j], elements.corners.shape).copy()
            load += double_layer(seen(i, j), i == j, elements, corner_velocity)
            if i != j:
                blocks[i, j] = single_layer(seen(i, j), False, elements)
        right.append(load.ravel())
    operator, outer_operator = one_body_operator(particle), one_body_operator(outer)
    operators = [operator] * len(centres) + [outer_operator]
    traction = solve_blocks(operators, blocks, right, tolerance)[:-1]
    return FORCE_UNIT * np.array([particle.forces @ f.reshape(-1, 3) for f in traction])


def fixed_spheres_in_outer_sphere(
    centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4
) -> Solution:
    """Force on each of n fixed, equal spheres as the paper finds it, with an error estimate.

    centres, flow, tolerance: as in `forces_on_fixed_spheres`. The scene is solved on two meshes;
    flat elements err as their number's inverse, so the finer one is off by the difference over
    that of the ratio of both numbers from one, taken MARGIN times, and by what the outer sphere
    adds. That is percents: the formulation is there for comparison, and most tolerances are out of
    its reach. Raises ValueError for what `forces_on_fixed_spheres` refuses.
    """
    tolerance = checked_tolerance(tolerance, 1e-8, 0.1)
    (centres, distance), flow = checked_scene(centres), flow_direction(flow)
    n = len(centres)
    gap = float(distance.min() - CONTACT)
    if not np.any(flow):
        return Solution(np.zeros((n, 3)), np.zeros(n), 0, 0.0, gap, Status.CONVERGED)
    forces, elements = [], []
    for size, outer_size in SIZES:
        mesh, outer = _mesh(size), _mesh(outer_size)
        elements.append(len(mesh.triangles))
        try:
            forces.append(forces_in_outer_sphere(centres, mesh, outer, flow))
        except RuntimeError:
            nowhere, unknown = np.full((n, 3), np.nan), np.full(n, np.inf)
            return Solution(nowhere, unknown, MOST_ITERATIONS, np.inf, gap, Status.NOT_CONVERGED)
    coarse, fine = forces
    difference = np.linalg.norm(fine - coarse, axis=1).max() / STOKES_DRAG
    wall = exact_drag_in_outer_sphere() / STOKES_DRAG - 1.0
    error = MARGIN * difference / (elements[1] / elements[0] - 1.0) + wall
    status = Status.CONVERGED if error <= tolerance else Status.OUT_OF_REACH
    # What GMRES leaves, at most its default tolerance, is far below all this.
    return Solution(fine, np.full(n, error), 0, RESIDUAL, gap, status)


@cache
def _mesh(size):
    return sphere_mesh(size)


def exact_drag_in_outer_sphere(ratio: float = PAPER_RATIO) -> float:
    """Drag on a sphere at the centre of one `ratio` times larger [Re_p c_D].

    Happel and Brenner, Low Reynolds number hydrodynamics, section 4-22. At the paper's ratio the
    wall adds 0.22 %.
    """
    x = 1.0 / ratio
    wall = (1.0 - x**5) / (1.0 - 9 / 4 * x + 5 / 2 * x**3 - 9 / 4 * x**5 + x**6)
    return STOKES_DRAG * wall
