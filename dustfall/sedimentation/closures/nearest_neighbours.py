"""The paper's closure: each particle feels its nearest neighbours, as if they moved with it."""

import hashlib
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numba import njit

from dustfall.columns import Column
from dustfall.forces.frames import MOST_NEIGHBOURS, rotation_to_streamwise
from dustfall.sedimentation.blocks import Blocks
from dustfall.sedimentation.closures.contacts import changed_neighbours, contacts
from dustfall.sedimentation.closures.names import NEAREST_NEIGHBOURS
from dustfall.sedimentation.neighbour_list import NeighbourList
from dustfall.sedimentation.state import Closure, Drag, State
from dustfall.streams import Purpose, stream
from dustfall.units import NEIGHBOURS, STOKES_DRAG

UP = np.array([0.0, 0.0, 1.0])

PROBES = 64
"""Random scenes on which two force models are told apart."""

PROBED_DISTANCES = (0.0, 2.5)
"""Their distances, as powers of ten [d_p]: from contact to a dilute cloud."""


class NearestNeighbours(Closure):
    """Drag on each particle from its k nearest neighbours in the periodic cube, by a force model.

    With F' the force in Re_p c_D in the frame where the flow -v runs along +y (paper, section
    "Integration of the IDNN into the CFD framework"), the drag on a particle is |v| R^T F' / 24
    in weights less buoyancy. Its part along the flow is -beta v with beta = F'_y / 24; the rest is
    the lateral force. A neighbour closer than contact is held at contact by the force models.

    Parameters
    ----------
    model : has `predict(neighbours)`, (n, k, 3) in d_p to (n, 3) in Re_p c_D, flow along +y
    neighbours : k; by default the model's own number, five where it takes any
    threads : that share the work of a step; their number changes no bit of the results

    Raises
    ------
    ValueError : k is not from 1 to 50, or not the number that the model takes.
    """

    name = NEAREST_NEIGHBOURS
    series: ClassVar = {
        "inverse_beta_mean": Column("1", "mean over particles of 1/beta, beta = F'_y / 24"),
        "beta_mean": Column("1", "mean over particles of beta = F'_y / 24"),
        "new_neighbours": Column("1", "fraction with another set of nearest than a step ago"),
        "only_farthest": Column("1", "fraction of these whose farthest neighbour alone changed"),
        "overlaps": Column("1", "pairs of neighbours with centres closer than a diameter"),
        "below_contact": Column("1", "neighbours that the force model sees closer than contact"),
    }

    def __init__(self, model, neighbours: int | None = None, threads: int = 1):
        own = getattr(model, "neighbours", None)
        default = NEIGHBOURS if own is None else own
        self.neighbours = int(default if neighbours is None else neighbours)
        if not 1 <= self.neighbours <= MOST_NEIGHBOURS:
            raise ValueError(f"{self.neighbours} neighbours: allowed are 1 to {MOST_NEIGHBOURS}")
        if own not in (None, self.neighbours):
            raise ValueError(f"{self.neighbours} neighbours: the model takes {own}")
        self.model = model
        self.threads = threads
        self._nearest: NeighbourList | None = None
        self._order: np.ndarray | None = None
        self._index: np.ndarray | None = None
        self._index_before: np.ndarray | None = None

    def __call__(self, state: State) -> Drag:
        """Return the drag of the moment. Raises FloatingPointError for a force not finite."""
        listed = self._nearest
        if listed is not None and (
            listed.box_length != state.box_length or len(listed.index) != len(state.position)
        ):
            self.remember({})  # another cloud
        if self._nearest is None:
            self._blocks = Blocks(len(state.position), self.threads)
            self._nearest = NeighbourList(
                len(state.position),
                state.box_length,
                self._blocks,
                self.neighbours,
                self._order,
                updates=state.steps,
            )
        nearest = self._nearest
        before, self._index = self._index, nearest.update(state.position)
        self._index_before = self._index if before is None else before
        velocity = state.velocity
        beta, lateral = np.empty(len(velocity)), np.empty_like(velocity)

        def work(first, last):
            rows = nearest.order[first:last]
            beta[rows], lateral[rows] = self._coefficients(state, rows)

        self._blocks.run(work)
        return Drag(beta, lateral)

    def _coefficients(self, state: State, rows: np.ndarray):
        """Return beta (m,) and the rest of the drag (m, 3) on the particles `rows`."""
        return drag_coefficients(self.model, state.velocity[rows], self._list.vectors(rows), rows)

    @property
    def _list(self) -> NeighbourList:
        assert self._nearest is not None, "the first call makes the list of neighbours"
        return self._nearest

    def statistics(self, state: State, drag: Drag) -> dict[str, float]:
        """Return the fields of `series`, after the call for this state."""
        means = {"inverse_beta_mean": (1 / drag.beta).mean(), "beta_mean": drag.beta.mean()}
        return {**means, **self._counts()}

    def _counts(self) -> dict[str, float]:
        nearest = self._list
        fresh, farthest_alone = changed_neighbours(nearest.index, self._index_before)
        overlaps, below_contact = contacts(
            nearest.vectors(nearest.order), nearest.order, nearest.index
        )
        return {
            "new_neighbours": fresh / len(nearest.index),
            "only_farthest": farthest_alone / fresh if fresh else np.nan,
            "overlaps": overlaps,
            "below_contact": below_contact,
        }

    def settings(self) -> dict[str, str | int | float]:
        """Return the model's name and a digest of its forces: models that differ differ there."""
        draws = stream(Purpose.PROBES, 0)
        direction = draws.normal(size=(PROBES, self.neighbours, 3))
        direction /= np.linalg.norm(direction, axis=2, keepdims=True)
        distance = 10 ** draws.uniform(*PROBED_DISTANCES, size=(PROBES, self.neighbours, 1))
        force = np.ascontiguousarray(self.model.predict(distance * direction))
        return {
            **super().settings(),
            "model": getattr(self.model, "name", type(self.model).__name__),
            "neighbours": self.neighbours,
            "model_digest": hashlib.sha256(force.tobytes()).hexdigest()[:16],
        }

    def memory(self) -> dict[str, np.ndarray]:
        """Return the neighbours of the last step, and the order in which particles lie."""
        if self._nearest is None:
            return {}
        return {"index": self._list.index, "order": self._list.order}

    def remember(self, memory: Mapping[str, np.ndarray]) -> None:
        """Go on from what `memory` returned, or start anew from nothing."""
        self._index, self._order = memory.get("index"), memory.get("order")
        self._nearest = None


def drag_coefficients(model, velocity: np.ndarray, neighbours: np.ndarray, rows=None):
    """Ask a force model for the drag on every particle.

    A particle at rest has no direction of flow and no drag; its beta is that of the flow it meets
    once it falls, along +z.

    Parameters
    ----------
    model : as `NearestNeighbours` takes it
    velocity : (n, 3) in v_s, box frame
    neighbours : (n, k, 3) from each particle to its neighbours in d_p, box frame
    rows : (n,) numbers of these particles, for the message of an error; by default 0 to n - 1

    Returns
    -------
    beta : (n,), drag against the motion over that of an isolated sphere, F'_y / 24
    lateral_force : (n, 3) in weights less buoyancy, box frame: the drag is
        `lateral_force - beta * velocity`

    Raises
    ------
    FloatingPointError : the model returned a force that is not finite.
    """
    at_rest = ~velocity.any(axis=1)
    flow = -velocity
    flow[at_rest] = UP
    rotation = rotation_to_streamwise(flow)
    force = np.ascontiguousarray(model.predict(_rotate(rotation, neighbours)), dtype=np.float64)
    if not np.isfinite(force).all():
        k = np.flatnonzero(~np.isfinite(force).all(axis=1))[0]
        particle = k if rows is None else rows[k]
        raise FloatingPointError(
            f"the force model returned {force[k]} for particle {particle}, which has velocity "
            f"{velocity[k]} and neighbours at {neighbours[k].tolist()}"
        )
    return force[:, 1] / STOKES_DRAG, _lateral_force(rotation, force, velocity)


@njit(cache=True, nogil=True)
def _rotate(rotation, neighbours):
    """R r for each neighbour of each particle."""
    rotated = np.empty_like(neighbours)
    for i in range(len(neighbours)):
        for j in range(neighbours.shape[1]):
            x, y, z = neighbours[i, j, 0], neighbours[i, j, 1], neighbours[i, j, 2]
            for axis in range(3):
                rotated[i, j, axis] = (
                    rotation[i, axis, 0] * x + rotation[i, axis, 1] * y + rotation[i, axis, 2] * z
                )
    return rotated


@njit(cache=True, nogil=True)
def _lateral_force(rotation, force, velocity):
    """|v| R^T (F'_x, 0, F'_z) / 24."""
    lateral = np.empty_like(velocity)
    for i in range(len(velocity)):
        speed = np.sqrt(velocity[i, 0] ** 2 + velocity[i, 1] ** 2 + velocity[i, 2] ** 2)
        scale = speed / STOKES_DRAG
        for axis in range(3):
            lateral[i, axis] = scale * (
                rotation[i, 0, axis] * force[i, 0] + rotation[i, 2, axis] * force[i, 2]
            )
    return lateral
