"""Sedimentation of monodisperse spheres in a periodic cube of fluid at rest."""

from dustfall.sedimentation.closures import (
    AllParticles,
    BackFlow,
    MovingNeighbours,
    NearestNeighbours,
)
from dustfall.sedimentation.neighbours import nearest_neighbours
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.settle import Checkpoint, Output, Schedule, settle
from dustfall.sedimentation.start import random_positions, random_start, start_from
from dustfall.sedimentation.state import Closure, Drag, State, box_length, move, step

__all__ = [
    "AllParticles",
    "BackFlow",
    "Checkpoint",
    "Closure",
    "Drag",
    "MovingNeighbours",
    "NearestNeighbours",
    "Output",
    "Properties",
    "Schedule",
    "State",
    "box_length",
    "move",
    "nearest_neighbours",
    "random_positions",
    "random_start",
    "settle",
    "start_from",
    "step",
]
