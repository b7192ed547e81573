"""How true the drag of a closure is in a cloud whose spheres move at random.

The truth is the multipole solver's, for spheres that turn freely. Clouds are open, 100 spheres in a
cube of one volume fraction without images, so that all can be asked the same question.
"""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
import pandas as pd
from scipy.spatial.distance import cdist

from dustfall.forces import load_model
from dustfall.sedimentation.closures.nearest_neighbours import drag_coefficients
from dustfall.sedimentation.start import random_start
from dustfall.solution import Status
from dustfall.stokes import resistance
from dustfall.streams import Purpose, stream
from dustfall.suspension.conjugate_gradients import conjugate_gradients
from dustfall.suspension.near_field import NearField
from dustfall.suspension.rotne_prager import free_mobility
from dustfall.units import NEIGHBOURS

FAR = 10.0
"""Side of the cube, in sides of the cloud, in which the near field sees no images."""

TORQUE_SHARE = 0.1
"""Residual of the torques, over the tolerance of the forces."""


def freely_turning_forces(centres, velocity, tolerance: float) -> tuple[np.ndarray, float, bool]:
    """Drag (n, 3) [3 pi mu d_p U] on spheres (n, 3) [d_p] that move at (n, 3) [U] without torque.

    The angular velocities at which no torque is left are found by conjugate gradients. Returns the
    drag, its largest error estimate and whether all solutions met the tolerance.
    """
    still = np.zeros_like(velocity)
    met = True

    def torques(moving, turning):
        nonlocal met
        solution = resistance(centres, moving, turning, tolerance=tolerance)
        met = met and solution.status == Status.CONVERGED
        return solution.torque

    right = torques(velocity, still)
    # A sphere alone has the torque -1 at angular velocity 1: the resistance, less its sign.
    turning, _ = conjugate_gradients(
        lambda spin: -torques(still, spin), right, right, TORQUE_SHARE * tolerance
    )
    solution = resistance(centres, velocity, turning, tolerance=tolerance)
    met = met and solution.status == Status.CONVERGED
    return solution.force, float(np.max(solution.error_estimate)), met


def nearest_neighbours_drag(model, centres, velocity) -> np.ndarray:
    """Drag (n, 3) that a force model of five neighbours tells each sphere: all move as it does."""
    clusters = centres[_with_nearest(centres)]
    beta, lateral = drag_coefficients(model, velocity, clusters[:, 1:] - clusters[:, :1])
    return lateral - beta[:, None] * velocity


def among_nearest(drag, centres, velocity) -> np.ndarray:
    """Drag (n, 3) on each sphere among its five neighbours alone, each at its own velocity."""
    return np.array([drag(centres[own], velocity[own])[0] for own in _with_nearest(centres)])


def _with_nearest(centres) -> np.ndarray:
    """Rows (n, 6): each sphere and its five nearest, nearest first."""
    return np.argsort(cdist(centres, centres), axis=1)[:, : NEIGHBOURS + 1]


def rotne_prager_drag(centres, velocity) -> np.ndarray:
    """Drag (n, 3) by the Rotne-Prager mobility of all spheres, inverted."""
    return -np.linalg.solve(free_mobility(centres), velocity.ravel()).reshape(-1, 3)


def near_field_drag(centres, velocity) -> np.ndarray:
    """The same, with what it lacks in the relative motion of close pairs."""
    side = FAR * np.ptp(centres, axis=0).max()
    near = NearField(centres, side, np.zeros_like(velocity), 0.0)
    return rotne_prager_drag(centres, velocity) - near.forces(velocity)


def moving_spheres(
    volume_fractions: Iterable[float],
    particles: int = 100,
    tolerance: float = 1e-3,
    seed: int = 1,
    progress=None,
) -> pd.DataFrame:
    """Tabulate the error of each way to the drag at random velocities, against the solver.

    Velocities are normal and independent. Returns the columns volume_fraction, particles, method,
    error (root mean square over spheres, over that of the true drag), largest (over the same),
    estimate (largest error estimate of the truth, in the drag of a lone sphere) and converged.
    """
    model = load_model()

    def exact(x, v):
        return freely_turning_forces(x, v, tolerance)[0]

    methods: dict[str, Callable] = {
        f"five neighbours ({model.name})": lambda x, v: nearest_neighbours_drag(model, x, v),
        "five moving neighbours, Rotne-Prager and near field": partial(
            among_nearest, near_field_drag
        ),
        "five moving neighbours, exact": partial(among_nearest, exact),
        "all, Rotne-Prager": rotne_prager_drag,
        "all, Rotne-Prager and near field": near_field_drag,
    }
    rows = []
    fractions = list(volume_fractions)
    for number, phi in enumerate(fractions):
        centres = random_start(particles, phi, seed).position
        velocity = stream(Purpose.MOVING_SPHERES, seed, number).normal(size=(particles, 3))
        truth, estimate, met = freely_turning_forces(centres, velocity, tolerance)
        scale = np.sqrt((truth**2).sum(axis=1).mean())
        for name, drag in methods.items():
            error = np.linalg.norm(drag(centres, velocity) - truth, axis=1)
            rows.append(
                {
                    "volume_fraction": phi,
                    "particles": particles,
                    "method": name,
                    "error": np.sqrt((error**2).mean()) / scale,
                    "largest": error.max() / scale,
                    "estimate": estimate,
                    "converged": met,
                }
            )
        if progress:
            progress(number + 1, len(fractions))
    return pd.DataFrame(rows)
