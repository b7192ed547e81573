"""Forces on fixed spheres in Stokes flow, by boundary elements."""

from dustfall.stokes.solve import forces_on_fixed_spheres

__all__ = ["forces_on_fixed_spheres"]
