"""Hydrodynamics of suspensions by the Rotne-Prager tensor: few spheres, and periodic cubes."""

from dustfall.suspension.ewald import PeriodicMobility

__all__ = ["PeriodicMobility"]
