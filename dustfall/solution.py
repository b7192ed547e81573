"""What every solver of spheres returns: forces or velocities, and what is known of them.

Stands apart from the solvers so that who reads their records need not load their kernels.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np


class Status(StrEnum):
    """How a solve ended."""

    CONVERGED = "converged"
    """The error estimate of every sphere is at most the tolerance."""

    OUT_OF_REACH = "out of reach"
    """The system is solved, but the discretisation ends before the tolerance is met."""

    NOT_CONVERGED = "not converged"
    """The iteration ended before the system was solved: the forces are not to be used."""


@dataclass(frozen=True)
class Solution:
    """Forces on n fixed spheres and what is known of their quality.

    force: (n, 3) [Re_p c_D]. error_estimate: (n,), of each sphere's force over that on an isolated
    sphere of its size, 24 for the diameter d_p. iterations, residual: of the linear system, the
    latter relative. minimum_gap: smallest distance of two surfaces [d_p], inf for one sphere.
    status: how it ended.
    """

    force: np.ndarray
    error_estimate: np.ndarray
    iterations: int
    residual: float
    minimum_gap: float
    status: Status


@dataclass(frozen=True)
class Resistance:
    """What the fluid exerts on n moving spheres, about their centres, and how well it is known.

    force: (n, 3) [3 pi mu d_p U]. torque: (n, 3), stresslet: (n, 3, 3), symmetric, without trace
    [pi mu d_p^2 U]. error_estimate: (n,), the largest error of |force| / d, |torque| / d^2 and
    |stresslet| / d^2, d the sphere's diameter, over `scale`. scale: (n,) [U], the larger of what
    these themselves are and of the fastest motion of any sphere against the undisturbed flow,
    |velocity| + d |gradient|. iterations, residual: of the linear system, the latter relative.
    minimum_gap: smallest distance of two surfaces [d_p], inf for one sphere. status: how it ended.
    """

    force: np.ndarray
    torque: np.ndarray
    stresslet: np.ndarray
    error_estimate: np.ndarray
    scale: np.ndarray
    iterations: int
    residual: float
    minimum_gap: float
    status: Status


@dataclass(frozen=True)
class Mobility:
    """How n spheres move under given forces and torques, and how well it is known.

    velocity: (n, 3) [U]. angular_velocity: (n, 3) [U / d_p]. stresslet: (n, 3, 3), by the fluid
    [pi mu d_p^2 U]. error_estimate: (n,), the largest error of |velocity|, d |angular_velocity|
    and |stresslet| / d^2, over `scale`. scale: (n,) [U], the larger of what these are against the
    undisturbed flow and of the largest |force| / d, |torque| / d^2 and d |gradient| of any sphere.
    Others as in `Resistance`.
    """

    velocity: np.ndarray
    angular_velocity: np.ndarray
    stresslet: np.ndarray
    error_estimate: np.ndarray
    scale: np.ndarray
    iterations: int
    residual: float
    minimum_gap: float
    status: Status
