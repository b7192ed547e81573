"""Ways to find the forces on fixed spheres: one call, and a solution that knows its quality."""

from dustfall.solution import Solution
from dustfall.stokes.plan import plan_scene
from dustfall.stokes.solve import solve


def fixed_spheres(
    centres, flow=(0.0, 1.0, 0.0), tolerance: float = 1e-4, method: str = "multipole"
) -> Solution:
    """Force on each of n fixed, equal spheres in a uniform Stokes flow, and what is known of it.

    centres, flow, tolerance: as in `forces_on_fixed_spheres`. method: a key of METHODS.
    Raises ValueError if shapes are wrong, values are not finite, spheres overlap, or the method is
    not known. What went wrong in the solve itself is told by the status.
    """
    if method not in METHODS:
        raise ValueError(f"method {method!r}: allowed are {', '.join(METHODS)}")
    return METHODS[method](centres, flow, tolerance)


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
