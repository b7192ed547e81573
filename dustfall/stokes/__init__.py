"""Forces on spheres in Stokes flow, fixed or moving, and velocities under given forces."""

from dustfall.solution import Mobility, Resistance, Solution, Status
from dustfall.stokes.methods import fixed_spheres, forces_on_fixed_spheres
from dustfall.stokes.moving import mobility, resistance

__all__ = [
    "Mobility",
    "Resistance",
    "Solution",
    "Status",
    "fixed_spheres",
    "forces_on_fixed_spheres",
    "mobility",
    "resistance",
]
