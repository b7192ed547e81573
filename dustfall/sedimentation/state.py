"""Particles that settle, and the step that moves them, whatever drag a closure gives them.

Units are those of an isolated sphere: length d_p, time tau, velocity v_s; gravity points along -z
and the fluid is at rest far away. Newton's law for one particle,

    m dv/dt = (m - m_f) g + drag,

divided by (m - m_f) g = 3 pi eta d_p v_s becomes, with the drag in weights less buoyancy,

    dv/dt = -e_z + drag,     dx/dt = (v_s tau / d_p) v,

since m / (3 pi eta d_p) = tau: buoyancy is inside v_s and the factor of gravity is one.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isclose
from typing import ClassVar

import numpy as np
from numba import njit

from dustfall.columns import Column
from dustfall.units import SPHERE_VOLUME

SERIES_BELOW = 0.05
"""Where `beta * step` is smaller, the differences of exponentials come from their series."""

SAME = 1e-9
"""Relative difference up to which two numbers are one that was computed in two ways."""

SERIES_TERMS = 10
"""Terms of that series: the first one left out is below 1e-16 of the sum."""


@dataclass(frozen=True)
class Drag:
    """How hard the fluid holds each particle, and which way: drag = force - beta * velocity.

    beta: (n,), what grows with the particle's own velocity, over the drag coefficient of an
    isolated sphere. force: (n, 3), the rest, in weights less buoyancy. whole_step: they hold for
    the coming step as a whole, and not for the moment at which it begins.
    """

    beta: np.ndarray
    force: np.ndarray
    whole_step: bool = False

    def on(self, velocity: np.ndarray) -> np.ndarray:
        """Drag (n, 3) on particles of `velocity` (n, 3) [v_s], in weights less buoyancy."""
        return self.force - self.beta[:, None] * velocity

    def coefficient(self, velocity: np.ndarray) -> np.ndarray:
        """Drag (n,) against the motion over that of an isolated sphere; at rest that of beta."""
        square = (velocity**2).sum(axis=1)
        along = (self.force * velocity).sum(axis=1)
        return self.beta - np.divide(along, square, out=np.zeros_like(along), where=square > 0.0)


@dataclass(frozen=True)
class State:
    """Particles in a periodic cube at one moment.

    position: (n, 3) [d_p], unwrapped. velocity: (n, 3) [v_s]. steps: taken since the start.
    last_drag: what the step that led here began with.
    """

    position: np.ndarray
    velocity: np.ndarray
    volume_fraction: float
    steps: int = 0
    last_drag: Drag | None = field(default=None, repr=False)

    @property
    def box_length(self) -> float:
        """Side of the cube [d_p]."""
        return box_length(len(self.position), self.volume_fraction)


class Closure(ABC):
    """What tells the drag on all particles from their state: `drag = closure(state)`.

    A closure may remember (lists of neighbours, the fluid's motion); what changes the bits of a
    run is in `memory`, from which a restarted run goes on.
    """

    name: str = ""
    series: ClassVar[Mapping[str, Column]] = {}
    """What `statistics` measures."""

    step: float | None = None
    """Step [tau] that it is made for; None where any will do."""

    stokes_number: float | None = None
    """v_s tau / d_p that it is made for; None where any will do."""

    viscosity: float | None = None
    """Kinematic, of the fluid that it is made for [d_p^2 / tau]; None where any will do."""

    volume_fraction: float | None = None
    """Of the cloud that it is made for; None where any will do."""

    @abstractmethod
    def __call__(self, state: State) -> Drag:
        """Return the drag on all particles. Called once for each step, one after the other."""

    def statistics(self, state: State, drag: Drag) -> dict[str, float]:
        """Return averages over particles and counts, after the call for this state."""
        return {}

    def settings(self) -> dict[str, str | int | float]:
        """Return what sets its results apart from those of another closure, in plain values."""
        return {"closure": self.name}

    def memory(self) -> dict[str, np.ndarray]:
        """Return the arrays that a restart needs beside the state."""
        return {}

    def remember(self, memory: Mapping[str, np.ndarray]) -> None:
        """Go on from what `memory` returned, or start anew from nothing.

        Raises ValueError for another closure's memory.
        """
        if memory:
            raise ValueError(f"{self.name} remembers nothing, but is given {', '.join(memory)}")


def step(state: State, closure: Closure, size: float, stokes_number: float) -> State:
    """Take one step of `size` [tau]; stokes_number is v_s tau / d_p.

    Raises ValueError for a closure that is made for another step, Stokes number or volume fraction.
    """
    check_closure(closure, size, stokes_number, state.volume_fraction)
    return move(state, closure(state), size, stokes_number)


def check_closure(
    closure: Closure,
    size: float,
    stokes_number: float,
    volume_fraction: float,
    viscosity: float | None = None,
) -> None:
    """Raise ValueError unless the closure is made for such a run.

    size: of a step [tau]. stokes_number: v_s tau / d_p. viscosity: kinematic, of the fluid
    [d_p^2 / tau], as far as it is known.
    """
    if closure.step not in (None, size):
        raise ValueError(f"{closure.name} is made for a step of {closure.step} tau, not {size}")
    for name, own, given in (
        ("Stokes number v_s tau / d_p", closure.stokes_number, stokes_number),
        ("volume fraction phi", closure.volume_fraction, volume_fraction),
        ("kinematic viscosity in d_p^2 / tau", closure.viscosity, viscosity),
    ):
        if own is not None and given is not None and not isclose(own, given, rel_tol=SAME):
            raise ValueError(f"{closure.name} is made for a {name} of {own}, not {given}")


def move(state: State, drag: Drag, size: float, stokes_number: float) -> State:
    """Move all particles through one step of `size` [tau], exactly for a drag law that holds.

    A law of the moment is extrapolated to the middle of the step from this step and the one
    before: second order, as long as it changes smoothly, with one call of the closure a step. A
    constant force over the whole step (beta = 0) gives the implicit midpoint rule:
    x' = x + St h (v + v') / 2.
    """
    beta, force = drag.beta, drag.force
    if state.last_drag is not None and not drag.whole_step:
        beta = 1.5 * beta - 0.5 * state.last_drag.beta
        force = 1.5 * force - 0.5 * state.last_drag.force
    position, velocity = _advance(state.position, state.velocity, beta, force, size, stokes_number)
    return State(position, velocity, state.volume_fraction, state.steps + 1, drag)


def box_length(particles: int, volume_fraction: float) -> float:
    """Side of the cube [d_p] that holds `particles` spheres: L = (n V_p / phi)^(1/3).

    From the paper, section "Mineral dust sedimentation". Raises ValueError without a particle, or
    for a volume fraction outside ]0, 1[.
    """
    if particles < 1:
        raise ValueError(f"{particles} particles: at least one is needed")
    if not 0 < volume_fraction < 1:
        raise ValueError(f"volume fraction phi is {volume_fraction}: allowed is 0 < phi < 1")
    return float((particles * SPHERE_VOLUME / volume_fraction) ** (1 / 3))


@njit(cache=True, nogil=True)
def _advance(position, velocity, beta, force, step, stokes_number):
    """Positions and velocities (n, 3) after a step in which beta (n,) and force (n, 3) hold.

    Exact (exponential integrator, e.g. Hochbruck & Ostermann 2010): v' = v + h phi1(beta h) a and
    x' = x + St h (v + h phi2(beta h) a), where a is the acceleration at the start of the step,
    phi1(q) = (1 - exp(-q)) / q and phi2(q) = (1 - phi1(q)) / q.
    """
    new_position = np.empty_like(position)
    new_velocity = np.empty_like(velocity)
    for i in range(len(position)):
        q = beta[i] * step
        if abs(q) < SERIES_BELOW:
            phi2 = 1.0
            for k in range(SERIES_TERMS, 2, -1):
                phi2 = 1.0 - q / k * phi2
            phi2 *= 0.5
            phi1 = 1.0 - q * phi2
        else:
            phi1 = -np.expm1(-q) / q
            phi2 = (1.0 - phi1) / q
        for axis in range(3):
            v = velocity[i, axis]
            acceleration = force[i, axis] - beta[i] * v
            if axis == 2:
                acceleration -= 1.0
            new_velocity[i, axis] = v + step * phi1 * acceleration
            new_position[i, axis] = position[i, axis] + stokes_number * step * (
                v + step * phi2 * acceleration
            )
    return new_position, new_velocity
