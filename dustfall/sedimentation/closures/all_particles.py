"""All particles of the periodic cube and their images feel each other, through the fluid's motion.

With f the forces of the particles on the fluid, M the Rotne-Prager mobility of all of them and u
the flow that earlier forces left behind, both at the middle of the step, particles move with the
fluid there, w = M f + u. D resists the relative motion of close pairs. Newton's law by the implicit
midpoint rule, and by implicit Euler for D, which is stiff,

    v' = v + h (-e_z - f - D v'),     w = (v + v') / 2,

is with A = 1 + h D the symmetric and positive definite system

    (M + h/2 A^-1) f = A^-1 ((1 + h/2 D) v - h/2 e_z) - u.

An explicit scheme would not do: the largest eigenvalue of M grows as n d_p / L.
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from dustfall.columns import Column
from dustfall.sedimentation.closures.names import ALL_PARTICLES
from dustfall.sedimentation.properties import Properties
from dustfall.sedimentation.state import Closure, Drag, State
from dustfall.spheres import plain
from dustfall.suspension import PeriodicMobility
from dustfall.suspension.conjugate_gradients import conjugate_gradients
from dustfall.suspension.near_field import NearField
from dustfall.suspension.splitting import Splitting, choose_splitting, splitting_with_waves

FLUIDS = ("unsteady", "quasi_steady")

UP = np.array([0.0, 0.0, 1.0])

POINTS_PER_PARTICLE, FEWEST_POINTS = 64, 64**3
"""That a grid may have for the sake of the waves that are kept: a step then takes up to three times
as long."""

SOLVED = 0.1
"""Residual of the forces over the tolerance of the mobility."""

STOPPING_STEPS = 1.5
"""Steps in which a pair may not touch if it goes straight on. One that is stopped still moves for
half a step, and one that is not for a whole one: then half a step is left."""

STIFF = 1e4
"""What the velocity of approach of a pair that would touch is divided by."""


class AllParticles(Closure):
    """Drag on each particle from all others and their images, with no net flux through the cube.

    The mobility is Rotne-Prager's, with what it lacks in the relative motion of close pairs
    (`NearField`). The fluid is at rest far away and obeys the unsteady Stokes equations or the
    steady ones. Unsteady, waves k of the smooth part of the mobility follow the forces S f as

        du/dt = nu k^2 (S f - u),     nu = St / Ga in d_p^2 / tau,

    solved exactly for forces that are constant over a step. Waves beyond the smooth part follow at
    once, as if they died out in no time. In a cube so large that a grid for all that take
    `shortest_memory` is not affordable, more do; the series tells the time that was reached. The
    fluid's advection is left out: `box_reynolds` says how far that is from true.

    Contact: pairs that would touch within one and a half steps lose their velocity of approach
    (implicitly, all pairs at once, without changing their momentum); nothing pushes pairs apart.

    Parameters
    ----------
    properties : of particles and fluid; St = v_s tau / d_p and Ga matter
    step : h, of the run [tau]
    fluid : "unsteady" or "quasi_steady"
    shortest_memory : waves that take longer to die out, by 1/e, are kept between steps [tau]. By
        default those with k < 1.9 v_s / nu for dust in air, which particles pass, by settling,
        faster than they die out
    tolerance : of the mobility, relative; forces are solved ten times as well
    threads : that share the work of a step; their number changes no bit of the results

    Raises
    ------
    ValueError : another fluid, or a time that is not positive.
    """

    name = ALL_PARTICLES
    step: float
    stokes_number: float
    viscosity: float
    series: ClassVar = {
        "products": Column("1", "products with the mobility that the step took"),
        "stopped": Column("1", "pairs stopped because they would touch"),
        "overlaps": Column("1", "pairs with centres closer than a diameter"),
        "box_reynolds": Column("1", "root mean square of velocity fluctuations times L / nu"),
        "memory_from": Column("tau", "time in which the shortest wave of the smooth part dies out"),
    }

    def __init__(
        self,
        properties: Properties,
        step: float,
        fluid: str = "unsteady",
        shortest_memory: float = 0.4,
        tolerance: float = 1e-3,
        threads: int = 1,
    ):
        if fluid not in FLUIDS:
            raise ValueError(f"fluid is {fluid!r}: allowed are {', '.join(FLUIDS)}")
        for name, value in {"step": step, "shortest_memory": shortest_memory}.items():
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value}: it has to be positive and finite, in tau")
        self.step = plain(step)
        self.stokes_number = properties.stokes_number
        self.viscosity = properties.stokes_number / properties.galileo
        self.fluid = fluid
        self.shortest_memory = plain(shortest_memory)
        self.tolerance = plain(tolerance)
        self.threads = threads
        self._splitting: Splitting | None = None
        self._force: np.ndarray | None = None
        self._force_before: np.ndarray | None = None
        self._waves: np.ndarray | None = None
        self._counts: dict[str, float] = {}

    def __call__(self, state: State) -> Drag:
        """Return the drag that holds for the coming step.

        A state of no steps, or of another cube or number of particles than the last, meets a fluid
        at rest. Raises ValueError for a cube too small for the near field, FloatingPointError where
        the forces are not found.
        """
        if state.steps == 0 or self._knows_another(state):
            self.remember({})
        splitting = self._splitting or self._begin(state)
        half = self.step / 2
        side = state.box_length
        mobility = PeriodicMobility(
            state.position + half * self.stokes_number * state.velocity,
            side,
            threads=self.threads,
            splitting=splitting,
        )
        order = mobility.order
        velocity = state.velocity[order]
        near = self._near(state, order)
        driven = velocity + half * near.forces(velocity) - half * UP
        force, products = conjugate_gradients(
            lambda f: mobility.product(f, self._response) + half * near.relaxed(f, self.step),
            near.relaxed(driven, self.step) - self._left_behind(mobility),
            self._guess(order),
            SOLVED * self.tolerance,
        )
        self._keep(mobility, force)
        middle = near.relaxed(driven - half * force, self.step)
        total = np.empty_like(velocity)
        total[order] = 2 * (middle - velocity) / self.step + UP
        fluctuation = np.sqrt(state.velocity.var(axis=0).sum())
        self._counts = {
            "products": products,
            "stopped": near.stopped,
            "overlaps": near.overlapping,
            "box_reynolds": fluctuation * side * self.stokes_number / self.viscosity,
            "memory_from": 1 / (self.viscosity * splitting.last_wavenumber**2),
        }
        return Drag(np.zeros(len(velocity)), total, whole_step=True)

    def _knows_another(self, state: State) -> bool:
        """Whether what is remembered is of a cloud of another size."""
        particles, side = len(state.position), state.box_length
        return (self._force is not None and len(self._force) != particles) or (
            self._splitting is not None and self._splitting.side != side
        )

    def _begin(self, state: State) -> Splitting:
        # For the mean density and for the whole run: the waves that are kept are those of its grid.
        particles, side = len(state.position), state.box_length
        splitting = choose_splitting(particles, side, self.tolerance)
        if self.fluid == "unsteady":
            last = 1 / np.sqrt(self.viscosity * self.shortest_memory)
            points = max(FEWEST_POINTS, POINTS_PER_PARTICLE * particles)
            splitting = splitting_with_waves(particles, side, self.tolerance, last, points)
        self._splitting = splitting
        self._response = splitting.influence
        if self.fluid == "unsteady":
            whole, half = splitting.wavenumbers
            square = whole[:, None, None] ** 2 + whole[:, None] ** 2 + half**2
            grown = -np.expm1(-self.viscosity * square * self.step)
            grown_half = -np.expm1(-self.viscosity * square * self.step / 2)
            as_stored = splitting.dtype
            self._response = splitting.influence * grown_half.astype(as_stored)
            self._gain = splitting.influence * grown.astype(as_stored)
            self._decay = (1 - grown).astype(as_stored)[..., None]
            self._decay_half = (1 - grown_half).astype(as_stored)[..., None]
            if self._waves is None:
                self._waves = np.zeros((*square.shape, 3), np.result_type(as_stored, np.complex64))
        return splitting

    def _near(self, state: State, order: np.ndarray) -> NearField:
        """Close pairs, in the order of the mobility."""
        way = STOPPING_STEPS * self.step * self.stokes_number * state.velocity[order]
        return NearField(state.position[order], state.box_length, way, STIFF / self.step)

    def _left_behind(self, mobility: PeriodicMobility):
        """Flow (n, 3) at the middle of the step that earlier forces left behind."""
        if self.fluid == "quasi_steady":
            return 0.0
        return mobility.at_particles(self._waves * self._decay_half)

    def _guess(self, order: np.ndarray) -> np.ndarray:
        """Forces by extrapolation from the last two steps."""
        if self._force is None:
            return np.zeros((len(order), 3))
        if self._force_before is None:
            return self._force[order]
        return 2 * self._force[order] - self._force_before[order]

    def _keep(self, mobility: PeriodicMobility, force: np.ndarray) -> None:
        """Keep forces, and the flow at the end of the step, for the next one."""
        self._force_before, self._force = self._force, np.empty_like(force)
        self._force[mobility.order] = force
        if self.fluid == "unsteady":
            self._waves = self._waves * self._decay + mobility.waves(force, self._gain)

    def statistics(self, state: State, drag: Drag) -> dict[str, float]:
        """Return the fields of `series`, after the call for this state."""
        return dict(self._counts)

    def settings(self) -> dict[str, str | int | float]:
        """Return what results depend on."""
        return {
            **super().settings(),
            "model": self.name,
            "fluid": self.fluid,
            "shortest_memory": self.shortest_memory,
            "tolerance": self.tolerance,
            "kinematic_viscosity": self.viscosity,
        }

    def memory(self) -> dict[str, np.ndarray]:
        """Return the forces of the last two steps, and the waves of the flow."""
        kept = {
            "force": self._force,
            "force_before": self._force_before,
            "waves": self._waves,
        }
        return {name: array for name, array in kept.items() if array is not None}

    def remember(self, memory: Mapping[str, np.ndarray]) -> None:
        """Go on from what `memory` returned, or start anew from nothing.

        Raises ValueError for a run in another fluid.
        """
        if memory and ("waves" in memory) != (self.fluid == "unsteady"):
            raise ValueError(f"the memory of a run is not that of a fluid that is {self.fluid}")
        self._force = memory.get("force")
        self._force_before = memory.get("force_before")
        self._waves = memory.get("waves")
        self._splitting = None
