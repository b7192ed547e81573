"""Nearest neighbours in a fluid that flows back: what each particle drags down, it rises around.

A few neighbours and no others let a suspension settle faster than a lone particle, because the
fluid that they take along comes back nowhere. Here it rises everywhere at one velocity u, chosen so
that a random suspension settles as an infinite one does (Batchelor 1972):

    u = <1/beta> - (1 - 6.55 phi),

with the mean over random surroundings of the same phi. The mean is repaired and nothing else:
seen from the rising fluid the cloud moves as that of `NearestNeighbours` does, since Newton's law
is the same in both frames, so that fluctuations, paths and clusters are the same, and what is left
of the speed-up comes from clusters alone.
"""

from dataclasses import replace

import numpy as np

from dustfall.sedimentation.closures.names import BACK_FLOW
from dustfall.sedimentation.closures.nearest_neighbours import (
    UP,
    NearestNeighbours,
    drag_coefficients,
)
from dustfall.sedimentation.neighbours import nearest_neighbours
from dustfall.sedimentation.start import random_positions
from dustfall.sedimentation.state import Drag, State, box_length
from dustfall.spheres import plain
from dustfall.streams import Purpose, stream
from dustfall.suspension.batchelor import BATCHELOR_COEFFICIENT

SURROUNDINGS = 30_000
"""Random surroundings that the mean is taken over: at phi = 1e-3 its standard error is 0.001."""


class BackFlow(NearestNeighbours):
    """Drag from the nearest neighbours in a fluid that rises at `velocity` [v_s].

    Parameters
    ----------
    model, neighbours, threads : as of `NearestNeighbours`
    volume_fraction : of the suspension, whose random mean is repaired, and of the run

    Raises
    ------
    ValueError : as `NearestNeighbours` does, or for a volume fraction that random addition cannot
        reach.
    """

    name = BACK_FLOW

    def __init__(
        self, model, volume_fraction: float, neighbours: int | None = None, threads: int = 1
    ):
        super().__init__(model, neighbours, threads)
        self.volume_fraction = volume_fraction = plain(volume_fraction)
        suspension = 1.0 + BATCHELOR_COEFFICIENT * volume_fraction
        self.velocity = random_mean(model, volume_fraction, self.neighbours) - suspension

    def __call__(self, state: State) -> Drag:
        """Return the drag of the moment. Raises FloatingPointError for a force not finite."""
        rising = self.velocity * UP
        drag = super().__call__(replace(state, velocity=state.velocity - rising))
        return Drag(drag.beta, drag.force + drag.beta[:, None] * rising)

    def settings(self) -> dict[str, str | int | float]:
        """Return those of the nearest neighbours, and how fast the fluid rises."""
        found = super().settings()
        own = {"model": self.name, "force_model": found["model"], "back_flow": self.velocity}
        return {**found, **own}


def random_mean(model, volume_fraction: float, neighbours: int) -> float:
    """Mean of 1/beta over particles at random places without overlap, all of one velocity.

    Parameters as of `BackFlow`. Raises ValueError as `random_positions` does.
    """
    draws = stream(Purpose.BACK_FLOW, 0)
    position = random_positions(draws, SURROUNDINGS, volume_fraction)
    side = box_length(SURROUNDINGS, volume_fraction)
    vectors, _ = nearest_neighbours(position, side, neighbours)
    beta, _ = drag_coefficients(model, np.tile(-UP, (SURROUNDINGS, 1)), vectors)
    return float((1 / beta).mean())
