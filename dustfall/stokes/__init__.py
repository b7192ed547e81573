"""Forces on fixed spheres in Stokes flow."""

from dustfall.solution import Solution, Status
from dustfall.stokes.solve import fixed_spheres, forces_on_fixed_spheres

__all__ = ["Solution", "Status", "fixed_spheres", "forces_on_fixed_spheres"]
