"""Sedimentation of monodisperse spheres in a periodic cube of fluid at rest."""

from dustfall.sedimentation.neighbours import nearest_neighbours
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import settle
from dustfall.sedimentation.start import cube_side, random_positions

__all__ = ["Properties", "cube_side", "nearest_neighbours", "random_positions", "settle"]
