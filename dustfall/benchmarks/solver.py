"""Run time of every method against the error of its force, on the same random scenes."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from dustfall.benchmarks.stokesian_dynamics import stokesian_dynamics
from dustfall.extras import extra
from dustfall.forces.formulas.reflections import reflected_forces
from dustfall.spheres import flow_direction
from dustfall.stokes.elements.boundary_elements import forces_by_elements
from dustfall.stokes.elements.mesh import sphere_mesh
from dustfall.stokes.elements.outer_sphere import forces_in_outer_sphere
from dustfall.stokes.methods import fixed_spheres
from dustfall.stokes.plan import plan_scene
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

MULTIPOLE, ELEMENTS = "multipoles", "boundary elements"

MESHED = 1e-4
"""Tightest tolerance that boundary elements are timed at: the next takes ten times as long."""

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

    scenes, few: scenes of each set for quick and for slow methods. This solver's boundary elements
    get five times the few, the paper's formulation on the paper's mesh one.
    """
    found = [Method(MULTIPOLE, _at(t), solver("multipole", t), scenes) for t in tolerances]
    found += [
        Method(ELEMENTS, _at(t), solver("elements", t), min(scenes, 5 * few))
        for t in tolerances
        if t >= MESHED
    ]
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
    found.append(Method("Stokesian dynamics", "F-T-S, exact pairs", _plain(lubricated), scenes))
    found.append(Method("reflected dipoles", "closed formula", _plain(reflections), scenes))
    for subdivisions, blobs in enumerate((12, 42, 162)):
        rigid = partial(multiblob_forces, subdivisions=subdivisions)
        most = scenes if blobs < 162 else few
        found.append(Method("rigid multiblob", f"{blobs} blobs", _plain(rigid), most))
    return found


def reference_sphere(force, estimate, true, _) -> tuple[float, float | None]:
    """Error of the force on the first sphere over 24, and what was estimated of it."""
    error = np.abs(force[0] - true[0]).max() / STOKES_DRAG
    return error, None if estimate is None else estimate[0]


def time_against_error(
    sets: Mapping[str, Sequence],
    methods: Sequence[Method],
    repeats: int = 3,
    progress=None,
    exact: Callable | None = None,
    compare: Callable = reference_sphere,
) -> pd.DataFrame:
    """Solve the scenes of every set by every method.

    sets: name -> scenes, as the methods take them. exact: what gives the true forces, this solver
    at 1e-8 by default. compare: takes a method's forces and estimates, or None, the true forces and
    the scene; returns error and estimate, by default of the force on the first sphere over 24. One
    row for each set and method: set, method, setting, scenes, milliseconds (a scene, after one to
    warm up; median of `repeats`, or one run of a method that takes a second and more),
    error_median, error_95, error_max, covered (share of scenes whose estimate is at least the
    error) and estimate_over_error (median), both NaN for a method without estimates.
    """
    exact, rows = exact or solver("multipole", EXACT), []
    for name, scenes in sets.items():
        truth = [exact(scene)[0] for scene in scenes]
        for method in methods:
            own = scenes[: method.most_scenes]
            start = time.perf_counter()
            method.forces(own[0])
            slow = time.perf_counter() - start > 1.0
            seconds = []
            for _ in range(1 if slow else repeats):
                start = time.perf_counter()
                found = [method.forces(scene) for scene in own]
                seconds.append(time.perf_counter() - start)
            compared = [
                compare(*one, true, scene)
                for one, true, scene in zip(found, truth, own, strict=False)
            ]
            error, estimate = np.array(compared, dtype=float).T
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
                row["covered"] = np.mean(estimate >= error)
                row["estimate_over_error"] = np.median(estimate / np.maximum(error, 1e-16))
            rows.append(row)
            if progress is not None:
                progress(len(rows), len(sets) * len(methods))
    return pd.DataFrame(rows)


def time_against_spheres(
    numbers: Sequence[int],
    fractions: Sequence[float] = (0.01, 1e-6),
    tolerance: float = 1e-4,
    seed: int = 1,
    repeats: int = 5,
) -> pd.DataFrame:
    """Solve n random spheres at each volume fraction, for each n: milliseconds and exponent.

    Columns volume_fraction, spheres, milliseconds (median of `repeats`, or one run where it takes a
    second and more), plan_milliseconds (of `plan_scene`, which is part of it), iterations,
    error_estimate (largest), status and exponent, the slope of log time against log n over all n
    from 8 of a volume fraction.
    """
    rows = []
    for phi in fractions:
        for n in numbers:
            centres = random_cloud(n, phi, stream(Purpose.BENCHMARK, seed, n))
            fixed_spheres(centres[:2], tolerance=tolerance)
            seconds: list[float] = []
            planned: list[float] = []
            while len(seconds) < repeats and sum(seconds[:1]) < 1.0:
                start = time.perf_counter()
                found = fixed_spheres(centres, tolerance=tolerance)
                seconds.append(time.perf_counter() - start)
                start = time.perf_counter()
                plan_scene(centres, tolerance)
                planned.append(time.perf_counter() - start)
            rows.append(
                (phi, n, 1e3 * np.median(seconds), 1e3 * np.median(planned), found.iterations,
                 found.error_estimate.max(), str(found.status))
            )  # fmt: skip
    columns = "volume_fraction spheres milliseconds plan_milliseconds iterations error_estimate"
    table = pd.DataFrame(rows, columns=[*columns.split(), "status"])
    many = table[table["spheres"] >= 8].groupby("volume_fraction")
    slopes = {
        phi: np.polyfit(np.log(own["spheres"]), np.log(own["milliseconds"]), 1)[0]
        for phi, own in many
    }
    return table.assign(exponent=table["volume_fraction"].map(slopes))


def rotne_prager(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Forces (n, 3) [Re_p c_D] from the inverse of pygrpy's Rotne-Prager mobility."""
    n = len(centres)
    blocks = muTT(2.0 * np.asarray(centres), np.ones(n))
    mobility = np.transpose(blocks, (0, 2, 1, 3)).reshape(3 * n, 3 * n)
    pull = np.linalg.solve(mobility, np.tile(flow_direction(flow), n))
    return STOKES_DRAG / (6.0 * np.pi) * pull.reshape(n, 3)


def lubricated(centres, flow=(0.0, 1.0, 0.0)) -> np.ndarray:
    """Forces (n, 3) [Re_p c_D] by Stokesian dynamics: fixed spheres are as moving ones."""
    velocity = np.tile(flow_direction(flow), (len(centres), 1))
    return -STOKES_DRAG * stokesian_dynamics(centres, velocity, np.zeros_like(velocity))


def reflections(centres) -> np.ndarray:
    """Force on the first sphere (1, 3) [Re_p c_D] by the closed formula of that name."""
    return reflected_forces(np.asarray(centres)[None, 1:] - centres[0])


def solver(method: str, tolerance: float) -> Callable:
    """This solver by one of its methods at a tolerance, as `Method.forces`."""

    def forces(centres):
        solution = fixed_spheres(centres, tolerance=tolerance, method=method)
        return solution.force, solution.error_estimate

    return forces


def _reference(centres):
    forces, estimate = reference_forces(centres, tolerance=EXACT)
    return forces, np.full(len(centres), estimate)


def _at(tolerance: float) -> str:
    return f"tolerance {tolerance:.0e}"


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
