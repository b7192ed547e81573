"""Hydrodynamics of suspensions by the Rotne-Prager tensor: six spheres, periodic mobility."""
