"""What a closed formula for the force is: a force model that needs no training."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from dustfall.forces.frames import check_neighbours, hold_at_contact, sort_by_distance


@dataclass(frozen=True)
class Formula:
    """A force model that needs no training, for one to `frames.MOST_NEIGHBOURS` neighbours.

    title: what figures and tables call it. force: the formula, neighbours (m, k, 3) [d_p], nearest
    first and no closer than contact, to forces (m, 3) [Re_p c_D], flow along +y. settles: clouds
    can settle with it; a formula whose drag can turn negative lets them fly apart.
    """

    name: str
    title: str
    force: Callable[[np.ndarray], np.ndarray]
    settles: bool = True

    def predict(self, neighbours) -> np.ndarray:
        """Force (m, 3) in Re_p c_D for neighbours (m, k, 3) in d_p, in any order.

        A neighbour closer to the reference sphere than contact is held at contact. Raises
        ValueError for neighbours of another shape, not finite, or at the centre.
        """
        return self.force(hold_at_contact(sort_by_distance(check_neighbours(neighbours))))


def load_formula(name: str) -> Formula:
    """The closed formula of the file `forces/formulas/<name>.py`.

    Raises ModuleNotFoundError where there is no such file, and ValueError for one of another name.
    """
    model = import_module(f"dustfall.forces.formulas.{name}").MODEL
    if model.name != name:
        raise ValueError(f"the formula in {name}.py is named {model.name!r}: names must agree")
    return model
