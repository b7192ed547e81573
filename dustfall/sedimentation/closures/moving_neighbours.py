"""Nearest neighbours that move, each in its own way: drag by the Rotne-Prager inverse, lubrication.

The paper's closure takes a particle's neighbours as moving with it. Here each has its own velocity
v_j in the resistance of the cluster, and close pairs resist their relative motion as two spheres
do: with M the mobility of the particle (0) and its k neighbours in fluid at rest and D the
resistance of `NearField`,

    drag_0 = -sum over j of (M^-1)_0j v_j - (D v)_0.

Pairs that move as one feel the same in both closures.
"""

from typing import ClassVar

import numpy as np
from numba import njit

from dustfall.columns import Column
from dustfall.forces.formula import load_formula
from dustfall.sedimentation.closures.all_particles import STIFF, STOPPING_STEPS, AllParticles
from dustfall.sedimentation.closures.nearest_neighbours import UP, NearestNeighbours
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.state import Drag, State
from dustfall.spheres import plain
from dustfall.suspension.near_field import NearField
from dustfall.suspension.rotne_prager import free_mobility


class MovingNeighbours(NearestNeighbours):
    """Drag on each particle from its k nearest neighbours, which move at their own velocities.

    A step is implicit in the particle's own velocity (midpoint rule) and, as it is stiff, in the
    resistance D of all close pairs (Euler); it is of first order in the velocities of neighbours.
    Contact is that of `AllParticles`: pairs that would touch within one and a half steps lose their
    velocity of approach.

    Parameters
    ----------
    properties : of particles and fluid; St = v_s tau / d_p matters
    step : h, of the run [tau]
    neighbours, threads : as of `NearestNeighbours`

    Raises
    ------
    ValueError : a step that is not positive, or k not from 1 to 50.
    """

    name = "moving_neighbours"
    step: float
    stokes_number: float
    series: ClassVar = {
        **{
            name: NearestNeighbours.series[name]
            for name in ("new_neighbours", "only_farthest", "overlaps", "below_contact")
        },
        "stopped": AllParticles.series["stopped"],
        "resistance_mean": Column("1", "mean over particles of a third of the trace of (M^-1)_00"),
    }

    def __init__(
        self,
        properties: Properties,
        step: float,
        neighbours: int | None = None,
        threads: int = 1,
    ):
        super().__init__(load_formula("rotne_prager"), neighbours, threads)
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"step is {step}: it has to be positive and finite, in tau")
        self.step = plain(step)
        self.stokes_number = properties.stokes_number
        self._measured: dict[str, float] = {}

    def __call__(self, state: State) -> Drag:
        """Return the drag that holds for the coming step.

        Raises ValueError for a cube too small for the near field.
        """
        drag = super().__call__(state)
        velocity, half = state.velocity, 0.5 * self.step
        way = STOPPING_STEPS * self.step * self.stokes_number * velocity
        near = NearField(state.position, state.box_length, way, STIFF / self.step)
        beta = drag.beta[:, None]
        driven = ((1 - half * beta) * velocity + self.step * (drag.force - UP)) / (1 + half * beta)
        after = near.relaxed(driven, self.step)
        self._measured = {"stopped": near.stopped, "resistance_mean": drag.beta.mean()}
        total = (after - velocity) / self.step + UP
        return Drag(np.zeros(len(velocity)), total, whole_step=True)

    def _coefficients(self, state, rows):
        nearest = self._list
        velocities = state.velocity[np.column_stack([rows, nearest.index[rows]])]
        return resistance_of_clusters(nearest.vectors(rows), velocities)

    def statistics(self, state: State, drag: Drag) -> dict[str, float]:
        """Return the fields of `series`, after the call for this state."""
        return {**self._counts(), **self._measured}

    def settings(self) -> dict[str, str | int | float]:
        """Return what results depend on."""
        return {**super().settings(), "model": self.name}


@njit(cache=True, nogil=True)
def resistance_of_clusters(neighbours, velocities):
    """Drag on the first sphere of each cluster that moves in fluid at rest, over Stokes drag.

    neighbours (m, k, 3) [d_p] from it to the others, velocities (m, k + 1, 3), its own first.
    Returns beta (m,), a third of the trace of (M^-1)_00, and force (m, 3): the drag is
    force - beta v_0.
    """
    clusters, others, _ = neighbours.shape
    beta, force = np.empty(clusters), np.empty((clusters, 3))
    centres = np.zeros((others + 1, 3))
    own = np.zeros((3 * (others + 1), 3))
    own[:3] = np.eye(3)
    for c in range(clusters):
        centres[1:] = neighbours[c]
        resistance = np.linalg.solve(free_mobility(centres), own)
        beta[c] = (resistance[0, 0] + resistance[1, 1] + resistance[2, 2]) / 3.0
        for axis in range(3):
            total = beta[c] * velocities[c, 0, axis]
            for j in range(others + 1):
                for other in range(3):
                    total -= resistance[3 * j + other, axis] * velocities[c, j, other]
            force[c, axis] = total
    return beta, force
