"""What each kind of learned model sees of a scene, and what it predicts."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from dustfall import STOKES_DRAG
from dustfall.forces.frames import (
    CONTACT,
    NEIGHBOURS,
    canonical_frame,
    hold_at_contact,
    lateral_to_canonical_frame,
    lateral_to_flow_frame,
    sort_by_distance,
    spherical_coordinates,
)
from dustfall.forces.reflections import reflected_forces

COMPONENTS = {"streamwise": [1], "lateral": [0, 2]}
"""Columns of the force that each network predicts."""

RADIAL_INPUTS = ("distance", "logarithm")


@dataclass(frozen=True)
class Kind:
    """A kind of learned model: which blocks, and which frame, inputs and baseline they stand on.

    decomposed: blocks of the IDNN, else one dense block.
    ordered: neighbours sorted by distance, else taken as they are given.
    anchored: canonical frame, inputs 1/r, log r and the unit vector, and the residual of the
    reflections; else flow frame, spherical coordinates and the deviation from Stokes drag.
    """

    decomposed: bool
    ordered: bool
    anchored: bool


KINDS = {
    "dense": Kind(decomposed=False, ordered=False, anchored=False),
    "idnn": Kind(decomposed=True, ordered=True, anchored=False),
    "anchored": Kind(decomposed=True, ordered=True, anchored=True),
}
"""The paper's dense ANN (flat vector of unsorted neighbours), its IDNN, and the anchored IDNN."""


@dataclass(frozen=True)
class Scenes:
    """Scenes as a network takes them.

    inputs: (m, 5, F), not yet normalised. envelope: (m, 4), weights of the second-order block and
    of neighbours 3 to 5 in the first-order block. baseline: (m, 3), force in the flow frame that
    the network's output adds to. axes: (m, 2, 2), lateral axes of the frame of that output.
    """

    inputs: np.ndarray
    envelope: np.ndarray
    baseline: np.ndarray
    axes: np.ndarray | None

    def residual(self, force: np.ndarray, component: str) -> np.ndarray:
        """Return what the network of `component` has to predict for a force (m, 3)."""
        residual = (force - self.baseline)[:, COMPONENTS[component]]
        if component == "lateral" and self.axes is not None:
            return lateral_to_canonical_frame(residual, self.axes)
        return residual

    def force(self, residual: np.ndarray, component: str) -> np.ndarray:
        """Return the force (m, 1) or (m, 2) of `component`: the inverse of `residual`."""
        if component == "lateral" and self.axes is not None:
            residual = lateral_to_flow_frame(residual, self.axes)
        return self.baseline[:, COMPONENTS[component]] + residual


def describe(kind: str, neighbours: np.ndarray, radial_input: str, largest: float) -> Scenes:
    """Return the scenes (m, 5, 3), in d_p, as networks of `kind` take them.

    `radial_input` is what spherical coordinates give for the distance: itself ("distance") or its
    natural logarithm. `largest` is the largest distance trained on: the networks see neighbours
    beyond it there. The outputs fade: for the anchored kind each block's as 1/distance^2 of its
    (nearest) neighbour; for the others all as 1/distance of the nearest neighbour, from `largest`
    on. So a reference sphere whose neighbours all move away goes over into Stokes drag.
    """
    layout = KINDS[kind]
    if layout.ordered:
        neighbours = sort_by_distance(neighbours)
    neighbours = hold_at_contact(neighbours)
    if layout.anchored:
        canonical, axes = canonical_frame(neighbours)
        inputs, envelope = _unit_vector_inputs(canonical, largest)
        return Scenes(inputs, envelope, reflected_forces(neighbours), axes)
    baseline = np.zeros((len(neighbours), 3))
    baseline[:, 1] = STOKES_DRAG
    inputs = spherical_coordinates(neighbours)
    fade = np.minimum(1.0, largest / inputs[:, :, 0].min(axis=1))
    radius = np.minimum(inputs[:, :, 0], largest)
    inputs[:, :, 0] = np.log(radius) if radial_input == "logarithm" else radius
    return Scenes(inputs, np.repeat(fade[:, None], NEIGHBOURS - 1, axis=1), baseline, None)


@njit(cache=True)
def _unit_vector_inputs(neighbours, largest):
    count = neighbours.shape[0]
    inputs = np.empty((count, NEIGHBOURS, 5))
    envelope = np.empty((count, NEIGHBOURS - 1))
    for m in range(count):
        for j in range(NEIGHBOURS):
            x, y, z = neighbours[m, j, 0], neighbours[m, j, 1], neighbours[m, j, 2]
            distance = np.sqrt(x * x + y * y + z * z)
            inputs[m, j, 0] = CONTACT / distance
            inputs[m, j, 1] = np.log(min(distance, largest))
            inputs[m, j, 2] = x / distance
            inputs[m, j, 3] = y / distance
            inputs[m, j, 4] = z / distance
            # Neighbours 0 and 1 share a block and the envelope of the nearer one.
            if j != 1:
                envelope[m, max(j - 1, 0)] = (CONTACT / distance) ** 2
    return inputs, envelope
