"""Run time of every method against the error of its force, on the same random scenes."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from dustfall.extras import extra
from dustfall.spheres import flow_direction
from dustfall.stokes.elements.boundary_elements import forces_by_elements
from dustfall.stokes.elements.mesh import sphere_mesh
from dustfall.stokes.elements.outer_sphere import forces_in_outer_sphere
from dustfall.stokes.methods import fixed_spheres
from dustfall.stokes.references.fundamental_solutions import reference_forces
from dustfall.stokes.references.multiblob import multiblob_forces
from dustfall.streams import Purpose, stream
from dustfall.units import STOKES_DRAG

with extra("benchmarks"):
    import pandas as pd
    from pygrpy.grpy_tensors import muTT

EXACT = 1e-8
"""Tolerance of the solve that errors are measured against."""

PAPER_EDGES = (0.162, 0.29)
"""Edges [radii] of meshes with 637 nodes a particle and 190 on the outer sphere: the paper's."""

MULTIPOLE = "multipoles"

RUNGS = {
    "constant, flat elements": (0.7, 0.35),
    "constant, projected elements": (0.7, 0.35),
    "linear Galerkin, projected elements": (1.0, 0.7),
    "quadratic Galerkin, projected elements": (1.0, 0.7),
}
"""Rungs of the ladder and edge lengths [radii] of the meshes that they are timed on."""


@dataclass(frozen=True)
class Method:
    """A way to get the forces (n, 3) on spheres at centres (n, 3).

    forces: takes centres, returns forces and error estimates (n,), or None in their place.
    most_scenes: of each set, so that a slow method does not take hours.
    """

    name: str
    setting: str
    forces: Callable
    most_scenes: int


def methods(tolerances: Sequence[float], scenes: int, few: int) -> list[Method]:
    """This solver at several tolerances, every rung of the ladder, references and peers.

    scenes, few: scenes of each set for quick and for slow methods. The
    paper's formulation on the paper's mesh gets one.
    """
    found = [Method(MULTIPOLE, f"tolerance {t:.0e}", multipole(t), scenes) for t in tolerances]
    for scheme, edges in RUNGS.items():
        for edge in edges:
            mesh = sphere_mesh(edge)
            rung = partial(forces_by_elements, mesh=mesh, scheme=scheme)
            found.append(Method(scheme, f"{len(mesh.triangles)} elements", _plain(rung), few))
    for edges, most in (((0.5, 0.7), few), (PAPER_EDGES, 1)):
        inner, outer = map(sphere_mesh, edges)
        paper = partial(forces_in_outer_sphere, mesh=inner, outer_mesh=outer)
        nodes = f"{len(inner.vertices)} nodes a sphere, {len(outer.vertices)} outside"
        found.append(Method("paper's formulation", nodes, _plain(paper), most))
    found.append(Method("fundamental solutions", "tolerance 1e-08", _reference, few))
    found.append(Method("Rotne-Prager inverse (pygrpy)", "", _plain(rotne_prager), scenes))
    for subdivisions, blobs in enumerate((12, 42, 162)):
        rigid = partial(multiblob_forces, subdivisions=subdivisions)
        most = scenes if blobs < 162 else few
        found.append(Method("rigid multiblob", f"{blobs} blobs", _plain(rigid), most))
    return found


def time_against_error(
    sets: Mapping[str, np.ndarray], methods: Sequence[Method], repeats: int = 3, progress=None
) -> pd.DataFrame:
    """Solve the scenes of every set by every method.

    sets: name -> centres (m, n, 3), the reference sphere first. Errors are those of the force on
    it over 24, against this solver at 1e-8. One row for each set and method: set, method, setting,
    scenes, milliseconds (a scene, after one to warm up; median of `repeats`, or one run of a
    method that takes a second and more), error_median,
    error_95, error_max, covered (share of scenes whose estimate is at least the error) and
    estimate_over_error (median), both NaN for a method without estimates.
    """
    exact, rows = multipole(EXACT), []
    for name, scenes in sets.items():
        truth = np.array([exact(centres)[0][0] for centres in scenes])
        for method in methods:
            own = scenes[: method.most_scenes]
            start = time.perf_counter()
            method.forces(own[0])
            slow = time.perf_counter() - start > 1.0
            seconds = []
            for _ in range(1 if slow else repeats):
                start = time.perf_counter()
                found = [method.forces(centres) for centres in own]
                seconds.append(time.perf_counter() - start)
            force = np.array([force[0] for force, _ in found])
            error = np.abs(force - truth[: len(own)]).max(axis=1) / STOKES_DRAG
            row = {
                "set": name,
                "method": method.name,
                "setting": method.setting,
                "scenes": len(own),
                "milliseconds": 1e3 * np.median(seconds) / len(own),
                "error_median": np.median(error),
                "error_95": np.quantile(error, 0.95),
                "error_max": error.max(),
            }
            if found[0][1] is not None:
                estimate = np.array([estimate[0] for _, estimate in found])
                row["covered"] = np.mean(estimate >= error)
                row["estimate_over_error"] = np.median(estimate / np.maximum(error, 1e-16))
            rows.append(row)
            if progress is not None:
                progress(len(rows), len(sets) * len(methods))
    return pd.DataFrame(rows)


def time_against_spheres(
    numbers: Sequence[int], tolerance: float = 1e-4, seed: int = 1, repeats: int = 5
) -> pd.DataFrame:
    """Solve n random spheres at a volume fraction of 1 %, for each n: milliseconds and exponent.

    Columns spheres, milliseconds (median of `repeats`), iterations, error_estimate (largest) and
    exponent, the slope of log time against log n over all n from 8.
    """
    rows = []
    for n in numbers:
        centres = random_cloud(n, 0.01, stream(Purpose.BENCHMARK, seed, n))
        seconds = []
        for _ in range(repeats + 1):
            start = time.perf_counter()
            found = fixed_spheres(centres, tolerance=tolerance)
            seconds.append(time.perf_counter() - start)
        rows.append((n, 1e3 * np.median(seconds[1:]), found.iterations, found.error_estimate.max()))
    table = pd.DataFrame(rows, columns=["spheres", "milliseconds", "iterations", "error_estimate"])
    many = table[table["spheres"] >= 8]
    slope = np.polyfit(np.log(many["spheres"]), np.log(many["milliseconds"]), 1)[0]
    return table.assign(exponent=slope)


def rotne_prager(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Forces (n, 3) [Re_p c_D] from the inverse of pygrpy's Rotne-Prager mobility."""
    n = len(centres)
    blocks = muTT(2.0 * np.asarray(centres), np.ones(n))
    mobility = np.transpose(blocks, (0, 2, 1, 3)).reshape(3 * n, 3 * n)
    pull = np.linalg.solve(mobility, np.tile(flow_direction(flow), n))
    return STOKES_DRAG / (6.0 * np.pi) * pull.reshape(n, 3)


def multipole(tolerance: float) -> Callable:
    """This solver at a tolerance, as `Method.forces`."""

    def forces(centres):
        solution = fixed_spheres(centres, tolerance=tolerance)
        return solution.force, solution.error_estimate

    return forces


def _reference(centres):
    forces, estimate = reference_forces(centres, tolerance=EXACT)
    return forces, np.full(len(centres), estimate)


def _plain(forces):
    """A method without an error estimate."""
    return lambda centres: (forces(centres), None)


def random_cloud(n: int, phi: float, stream) -> np.ndarray:
    """n centres (n, 3) [d_p] drawn one after the other in a cube, without overlap."""
    edge = (n * np.pi / 6.0 / phi) ** (1.0 / 3.0)
    centres = np.empty((0, 3))
    while len(centres) < n:
        centre = edge * stream.random(3)
        if (np.linalg.norm(centres - centre, axis=1) > 1.0).all():
            centres = np.vstack([centres, centre])
    return centres
