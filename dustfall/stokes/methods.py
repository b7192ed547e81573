"""Ways to find the forces on fixed spheres: one call, and a solution that knows its quality."""

import warnings

import numpy as np

from dustfall.solution import Solution, Status
from dustfall.spheres import checked_radii, flow_direction
from dustfall.stokes.moving import resistance
from dustfall.stokes.plan import plan_scene
from dustfall.stokes.solve import solve
from dustfall.units import RADIUS, STOKES_DRAG


def forces_on_fixed_spheres(
    centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4, radii=None
) -> np.ndarray:
    """Force on each of n fixed spheres in a uniform Stokes flow.

    centres: (n, 3) in d_p. flow: (3,), velocity far away; forces are made dimensionless by its
    magnitude. tolerance: of the force, relative to that on an isolated sphere, 1e-8 to 0.1.
    radii: (n,) in d_p, 0.5 by default.
    Returns (n, 3) in Re_p c_D: an isolated sphere of diameter d_p feels 24 along the flow, another
    24 times its diameter; no flow, no force.
    Raises ValueError if shapes are wrong, values are not finite, or spheres overlap, and
    RuntimeError if GMRES does not converge. Warns where the estimated error exceeds the tolerance.
    """
    solution = fixed_spheres(centres, flow, tolerance, radii=radii)
    if solution.status == Status.NOT_CONVERGED:
        raise RuntimeError(
            f"GMRES stopped at a residual of {solution.residual:.1e} after "
            f"{solution.iterations} iterations; smallest gap {solution.minimum_gap:.1e} d_p"
        )
    if solution.status == Status.OUT_OF_REACH:
        warnings.warn(
            f"the estimated error, {solution.error_estimate.max():.1e}, exceeds the tolerance, "
            f"{tolerance:.1e}: the smallest gap is {solution.minimum_gap:.1e} d_p",
            RuntimeWarning,
            stacklevel=2,
        )
    return solution.force


def fixed_spheres(
    centres,
    flow=(0.0, 1.0, 0.0),
    tolerance: float = 1e-4,
    method: str = "multipole",
    radii=None,
) -> Solution:
    """Force on each of n fixed spheres in a uniform Stokes flow, and what is known of it.

    centres, flow, tolerance, radii: as in `forces_on_fixed_spheres`. method: a key of METHODS;
    "multipole" alone takes radii.
    Raises ValueError if shapes are wrong, values are not finite, spheres overlap, or the method is
    not known; of "multipole" MemoryError before more memory is taken than there is. What went wrong
    in the solve itself is told by the status.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: allowed are {', '.join(METHODS)}")
    if radii is not None and np.any(checked_radii(radii, len(np.atleast_1d(centres))) != RADIUS):
        if method != "multipole":
            raise ValueError(f"method {method!r} takes equal spheres alone, no radii")
        return of_any_radii(centres, flow, tolerance, radii)
    return METHODS[method](centres, flow, tolerance)


def of_any_radii(centres, flow, tolerance, radii) -> Solution:
    """Solve a scene of spheres that move in the special way that they do not."""
    found = resistance(
        centres, np.zeros(np.shape(centres)), flow=flow_direction(flow), radii=radii,
        tolerance=tolerance,
    )  # fmt: skip
    estimate, status = found.error_estimate * found.scale, found.status
    if status == Status.CONVERGED and estimate.max() > tolerance:
        status = Status.OUT_OF_REACH
    return Solution(
        STOKES_DRAG * found.force, estimate, found.iterations, found.residual, found.minimum_gap,
        status,
    )  # fmt: skip


def by_multipoles(centres, flow, tolerance) -> Solution:
    """Plan a scene and solve it."""
    return solve(plan_scene(centres, tolerance), flow, tolerance)


def by_elements(centres, flow, tolerance) -> Solution:
    """Mesh a scene and solve it by boundary elements; what it returns has the meshes too."""
    # gmsh wants libraries of a desktop, which who needs no mesh may not have.
    from dustfall.stokes.elements.scene import fixed_spheres_on_meshes

    return fixed_spheres_on_meshes(centres, flow, tolerance)


def as_in_the_paper(centres, flow, tolerance) -> Solution:
    """Solve a scene within an outer sphere, as the paper does, on flat elements."""
    from dustfall.stokes.elements.outer_sphere import fixed_spheres_in_outer_sphere

    return fixed_spheres_in_outer_sphere(centres, flow, tolerance)


METHODS = {"multipole": by_multipoles, "elements": by_elements, "paper": as_in_the_paper}
"""Ways to solve a scene: functions of centres, flow and tolerance."""
