"""Forces on fixed spheres in Stokes flow."""

from dustfall.solution import Solution, Status
from dustfall.stokes.methods import fixed_spheres
from dustfall.stokes.solve import forces_on_fixed_spheres

__all__ = ["Solution", "Status", "fixed_spheres", "forces_on_fixed_spheres"]
