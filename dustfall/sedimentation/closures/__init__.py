"""Closures: what tells the drag on all particles from their state."""

from dustfall.sedimentation.closures.all_particles import AllParticles
from dustfall.sedimentation.closures.back_flow import BackFlow
from dustfall.sedimentation.closures.moving_neighbours import MovingNeighbours
from dustfall.sedimentation.closures.nearest_neighbours import NearestNeighbours

__all__ = ["AllParticles", "BackFlow", "MovingNeighbours", "NearestNeighbours"]
