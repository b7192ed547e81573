"""The force models that need no training, by name."""

from dustfall.forces.reflections import Reflections
from dustfall.forces.rotne_prager import IsolatedStokes, RotnePrager, Stokeslets

FORMULAS = {
    "isolated": IsolatedStokes,
    "stokeslets": Stokeslets,
    "rotne_prager": RotnePrager,
    "reflections": Reflections,
}
