"""What every solver of fixed spheres returns: the forces, and what is known of them.

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
    sphere, 24. iterations, residual: of the linear system, the latter relative. minimum_gap:
    smallest distance of two surfaces [d_p], inf for one sphere. status: how it ended.
    """

    force: np.ndarray
    error_estimate: np.ndarray
    iterations: int
    residual: float
    minimum_gap: float
    status: Status
