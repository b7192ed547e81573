"""Force models behind one interface: `predict(neighbours (m, 5, 3)) -> force (m, 3)`.

Neighbours are Cartesian, in d_p, in the frame of the flow (x spanwise, y streamwise, z vertical);
forces are in Re_p c_D, where an isolated sphere feels 24 along the flow.
"""

from dustfall.forces.frames import rotation_to_streamwise, spherical_coordinates
from dustfall.forces.models import LearnedModel, load_model
from dustfall.forces.reflections import Reflections
from dustfall.forces.rotne_prager import (
    IsolatedStokes,
    RotnePrager,
    Stokeslets,
    rotne_prager_forces,
)

_TRAINING = {
    "PAPER_SETTINGS": "training",
    "SETTINGS": "training",
    "TrainingSettings": "training",
    "choose_winner": "cross_validation",
    "cross_validate": "cross_validation",
    "train_model": "training",
}

__all__ = [
    "PAPER_SETTINGS",
    "SETTINGS",
    "IsolatedStokes",
    "LearnedModel",
    "Reflections",
    "RotnePrager",
    "Stokeslets",
    "TrainingSettings",
    "choose_winner",
    "cross_validate",
    "load_model",
    "rotation_to_streamwise",
    "rotne_prager_forces",
    "spherical_coordinates",
    "train_model",
]


def __getattr__(name):
    # Training needs PyTorch, prediction does not: only who trains waits seconds for its import.
    if name not in _TRAINING:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_TRAINING[name]}"), name)
