"""Force models behind one interface: `predict(neighbours (m, 5, 3)) -> force (m, 3)`.

Neighbours are Cartesian, in d_p, in the frame of the flow (x spanwise, y streamwise, z vertical);
forces are in Re_p c_D, where an isolated sphere feels 24 along the flow.
"""

from dustfall.forces.frames import rotation_to_streamwise, spherical_coordinates
from dustfall.forces.learned import LearnedModel, load_model
from dustfall.forces.reflections import Reflections
from dustfall.forces.rotne_prager import (
    IsolatedStokes,
    RotnePrager,
    Stokeslets,
    rotne_prager_forces,
)

__all__ = [
    "IsolatedStokes",
    "LearnedModel",
    "Reflections",
    "RotnePrager",
    "Stokeslets",
    "load_model",
    "rotation_to_streamwise",
    "rotne_prager_forces",
    "spherical_coordinates",
]
