"""Run time against error for spheres that translate and turn, each in its own way."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.spatial.distance import cdist

from dustfall.benchmarks.solver import MULTIPOLE, Method
from dustfall.benchmarks.stokesian_dynamics import stokesian_dynamics
from dustfall.extras import extra
from dustfall.stokes import resistance
from dustfall.stokes.references.fundamental_solutions import reference_loads
from dustfall.stokes.references.multiblob import moving_multiblob_forces
from dustfall.streams import Purpose, stream

with extra("benchmarks"):
    from pygrpy.grpy_tensors import mu

EXACT = 1e-7
"""Tolerance of the solve that errors are measured against."""

SPHERES = 6

GAPS = {"moving, gaps from 0.2": (0.2, 2.0), "moving, gaps from 0.02": (0.02, 0.2)}
"""Sets, and the gaps [d_p] between a sphere and that which it is put beside; no gap is narrower."""


def moving_sets(scenes: int, seed: int = 1) -> dict[str, list]:
    """Random clusters of each set: (centres, velocity, angular velocity), (n, 3) each.

    Each sphere is put beside one that is there already, at a gap that is log-uniform between the
    ends of the set; velocities and angular velocities are normal with variance 1.
    """
    return {
        name: [_cluster(*ends, stream(Purpose.MOVING, seed, number, k)) for k in range(scenes)]
        for number, (name, ends) in enumerate(GAPS.items())
    }


def moving_methods(tolerances: Sequence[float], scenes: int, few: int) -> list[Method]:
    """This solver at several tolerances, an independent reference, peers.

    scenes, few: scenes of each set for quick and for slow methods.
    """
    found = [Method(MULTIPOLE, f"tolerance {t:.0e}", moving(t), scenes) for t in tolerances]
    found.append(Method("fundamental solutions", "tolerance 1e-03", _reference, few))
    found.append(Method("Rotne-Prager inverse (pygrpy)", "", rotne_prager, scenes))
    for subdivisions, blobs in enumerate((12, 42, 162)):
        rigid = partial(_multiblob, subdivisions=subdivisions)
        most = scenes if blobs < 162 else few
        found.append(Method("rigid multiblob", f"{blobs} blobs", rigid, most))
    found.append(Method("Stokesian dynamics", "F-T-S, exact pairs", _lubricated, scenes))
    return found


def all_spheres(force, estimate, true, scene) -> tuple[float, float | None]:
    """Largest error of a force over the force or the fastest motion, and the largest estimate.

    The motion is |velocity| + |gradient| of a sphere, as in the estimates of `resistance`.
    """
    _, velocity, angular_velocity = scene
    turning = np.sqrt(2.0) * np.linalg.norm(angular_velocity, axis=1)
    fastest = np.max(np.linalg.norm(velocity, axis=1) + turning)
    size = np.maximum(np.linalg.norm(true, axis=1), fastest)
    error = np.max(np.linalg.norm(force - true, axis=1) / size)
    return error, None if estimate is None else estimate.max()


def moving(tolerance: float):
    """This solver at a tolerance, as `Method.forces`."""

    def forces(scene):
        solution = resistance(*scene, tolerance=tolerance)
        return solution.force, solution.error_estimate

    return forces


def rotne_prager(scene):
    """Forces (n, 3) [3 pi mu d_p U] from the inverse of pygrpy's mobility, rotations included."""
    centres, velocity, angular_velocity = scene
    n = len(centres)
    mobility = mu(2.0 * centres, np.ones(n))
    motion = np.concatenate([velocity.ravel(), 0.5 * angular_velocity.ravel()])
    pull = np.linalg.solve(mobility, motion)[: 3 * n]
    return -pull.reshape(n, 3) / (6.0 * np.pi), None


def _reference(scene):
    loads = reference_loads(*scene, tolerance=1e-3)
    return loads.force, loads.error_estimate


def _lubricated(scene):
    return stokesian_dynamics(*scene), None


def _multiblob(scene, subdivisions):
    return moving_multiblob_forces(*scene, subdivisions), None


def _cluster(narrowest, widest, rng):
    centres = np.zeros((1, 3))
    while len(centres) < SPHERES:
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        gap = np.exp(rng.uniform(np.log(narrowest), np.log(widest)))
        place = centres[rng.integers(len(centres))] + (1.0 + gap) * direction
        if cdist(centres, place[None]).min() >= 1.0 + narrowest:
            centres = np.vstack([centres, place])
    return centres, *rng.normal(size=(2, SPHERES, 3))
