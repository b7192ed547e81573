"""Force models behind one interface: `predict(neighbours (m, k, 3)) -> force (m, 3)`.

Neighbours are Cartesian, in d_p, in the frame of the flow (x spanwise, y streamwise, z vertical);
forces are in Re_p c_D, where an isolated sphere feels 24 along the flow.
"""

from dustfall.forces.formula import Formula
from dustfall.forces.formulas import FORMULAS
from dustfall.forces.frames import rotation_to_streamwise, spherical_coordinates
from dustfall.forces.learned import LearnedModel, load_model
from dustfall.forces.registry import FORCE_MODELS, title

__all__ = [
    "FORCE_MODELS",
    "FORMULAS",
    "Formula",
    "LearnedModel",
    "load_model",
    "rotation_to_streamwise",
    "spherical_coordinates",
    "title",
]
