"""What each kind of learned model sees of a scene, and what it predicts."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from dustfall.forces.formulas.isolated import MODEL as ISOLATED
from dustfall.forces.formulas.reflections import MODEL as REFLECTIONS
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.forces.frames import (
    canonical_frame,
    hold_at_contact,
    lateral_to_canonical_frame,
    lateral_to_flow_frame,
    sort_by_distance,
    spherical_coordinates,
)
from dustfall.units import COMPONENTS, CONTACT

RADIAL_INPUTS = ("distance", "logarithm")
"""What spherical coordinates give a network for the distance: itself, or its logarithm."""

FEWEST = {"dense": 1, "pairwise": 1, "decomposed": 3}
"""Fewest neighbours that give each block of a network something to see."""


def block_inputs(blocks: str, neighbours: int) -> np.ndarray:
    """What the blocks of a network are given, one row each time: (block inputs, 3).

    A row is block, first neighbour, number of neighbours; the outputs add up. blocks: "dense", one
    block for all neighbours; "pairwise", one for each neighbour alone; "decomposed", one for the
    two nearest and one for each other: F = F_12 + F_3 + F_4 + F_5 (paper, Fig. nnModel).
    Raises ValueError for too few neighbours.
    """
    if neighbours < FEWEST[blocks]:
        raise ValueError(
            f"{neighbours} neighbours: a {blocks} network needs at least {FEWEST[blocks]}"
        )
    if blocks == "dense":
        return np.array([[0, 0, neighbours]])
    if blocks == "pairwise":
        return np.array([[0, j, 1] for j in range(neighbours)])
    return np.array([[0, 0, 2], *([1, j, 1] for j in range(2, neighbours))])


@dataclass(frozen=True)
class Kind:
    """A kind of learned model: which blocks, and which frame, inputs and baseline they stand on.

    title: what figures and tables call it. blocks: as `block_inputs` takes them. ordered:
    neighbours sorted by distance, else as they are given. unit_vectors: inputs 1/r, log r and the
    unit vector, else spherical coordinates. canonical: canonical frame of the symmetries, else the
    flow's. baseline: formula that the networks' output adds to. final: the campaign trains it on
    all that it may learn from; else it is one step of the ablation.
    """

    title: str
    blocks: str
    ordered: bool = True
    unit_vectors: bool = False
    canonical: bool = False
    baseline: str = "isolated"
    final: bool = True


KINDS = {
    "dense": Kind("dense network", "dense", ordered=False),
    "dense_sorted": Kind("dense network, sorted", "dense"),
    "pairwise": Kind("pairwise network", "pairwise"),
    "idnn": Kind("IDNN", "decomposed"),
    "unit_vectors": Kind("IDNN, unit vectors", "decomposed", unit_vectors=True, final=False),
    "canonical": Kind(
        "IDNN, canonical frame", "decomposed", unit_vectors=True, canonical=True, final=False
    ),
    "residual": Kind(
        "IDNN on Rotne–Prager",
        "decomposed",
        unit_vectors=True,
        canonical=True,
        baseline="rotne_prager",
        final=False,
    ),
    "anchored": Kind(
        "anchored IDNN", "decomposed", unit_vectors=True, canonical=True, baseline="reflections"
    ),
    "anchored_pairwise": Kind(
        "anchored pairwise network",
        "pairwise",
        unit_vectors=True,
        canonical=True,
        baseline="reflections",
        final=False,
    ),
}
"""The paper's dense ANN (flat vector of unsorted neighbours) and the same sorted; its first-order
block alone (Seyed-Ahmadi & Wachs 2022); its IDNN; then, one change at a time, the anchored IDNN."""


@dataclass(frozen=True)
class Scenes:
    """Scenes as a network takes them.

    inputs: (m, k, F), not yet normalised. envelope: (m, block inputs), weight of
    the output for each.
    baseline: (m, 3), force in the flow frame that the network's output adds to. axes: (m, 2, 2),
    lateral axes of the frame of that output, where it is not the flow's.
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


BASELINES = {formula.name: formula for formula in (ISOLATED, ROTNE_PRAGER, REFLECTIONS)}
"""Formulas that networks may stand on."""

FADING = {"isolated": 1, "rotne_prager": 1, "reflections": 4}
"""Power of 1/distance by which what the networks add to a baseline falls, as its error does."""


def describe(kind: str, neighbours: np.ndarray, radial_input: str, largest: float) -> Scenes:
    """Return the scenes (m, k, 3), in d_p, as networks of `kind` take them.

    `radial_input` is what spherical coordinates give for the distance: itself ("distance") or its
    natural logarithm. `largest` is the largest distance trained on: the networks see neighbours
    beyond it there; with unit vectors log r is held there, and 1/r is not. The outputs fade, so
    that a reference sphere whose neighbours all move away goes over into Stokes drag: with
    spherical coordinates as 1/distance of the nearest neighbour, from `largest` on; with unit
    vectors each block input as 1/distance of its (nearest) neighbour, on the reflections, whose
    error falls sooner, as its fourth power.
    """
    layout = KINDS[kind]
    if layout.ordered:
        neighbours = sort_by_distance(neighbours)
    neighbours = hold_at_contact(neighbours)
    seen, axes = canonical_frame(neighbours) if layout.canonical else (neighbours, None)
    first = block_inputs(layout.blocks, neighbours.shape[1])[:, 1]
    if layout.unit_vectors:
        inputs = _unit_vectors(seen, largest)
        power = FADING[layout.baseline]
        envelope = inputs[:, first, 0] ** power
    else:
        inputs = spherical_coordinates(seen)
        fade = np.minimum(1.0, largest / inputs[:, :, 0].min(axis=1))
        radius = np.minimum(inputs[:, :, 0], largest)
        inputs[:, :, 0] = np.log(radius) if radial_input == "logarithm" else radius
        envelope = np.repeat(fade[:, None], len(first), axis=1)
    return Scenes(inputs, envelope, BASELINES[layout.baseline].force(neighbours), axes)


@njit(cache=True, nogil=True)
def _unit_vectors(neighbours, largest):
    count, others, _ = neighbours.shape
    inputs = np.empty((count, others, 5))
    for m in range(count):
        for j in range(others):
            x, y, z = neighbours[m, j, 0], neighbours[m, j, 1], neighbours[m, j, 2]
            distance = np.sqrt(x * x + y * y + z * z)
            inputs[m, j, 0] = CONTACT / distance
            inputs[m, j, 1] = np.log(min(distance, largest))
            inputs[m, j, 2] = x / distance
            inputs[m, j, 3] = y / distance
            inputs[m, j, 4] = z / distance
    return inputs
