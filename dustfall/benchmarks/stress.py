"""Stress tests of the solver's numerical stability: each returns a table of what it measured."""

import time
from functools import cache

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from dustfall.spheres import centre_distances, flow_direction
from dustfall.stokes.elements.mesh import SphereMesh, sphere_mesh
from dustfall.stokes.elements.one_body import OneBody
from dustfall.stokes.elements.single_layer import nodal_integrals, self_interaction
from dustfall.stokes.harmonics import exact_response
from dustfall.stokes.methods import fixed_spheres
from dustfall.stokes.multipoles import NO_CLOSE_PAIRS, apply_system, couple_scene, solve_scene
from dustfall.stokes.plan import SMALLEST_TOLERANCE, plan_scene
from dustfall.stokes.references.exact_pairs import forces_on_two_spheres
from dustfall.stokes.solve import response_rows, solve
from dustfall.stokes.translation import translation_tables
from dustfall.streams import Purpose, stream
from dustfall.units import CONTACT, FORCE_UNIT, RADIUS, STOKES_DRAG

FLOW = np.array([0.36, 0.8, 0.48])
"""Unit flow in no special direction of the clusters."""

CROWDS, TURNS, MESH_TURN = range(3)
"""Items of the random streams."""

CLUSTERS = {
    "pair": np.array([[0, 0, 0], [0, 0, 1]]),
    "triangle": np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]]),
    "chain of three": np.array([[0, 0, 0], [0, 0, 1], [0, 0, -1]]),
    "six": np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]),
}
"""Centres [d_p] of clusters that touch; times 1 + gap they are that far apart."""

LURES = ((1e-2, 325.0), (1e-3, 910.0), (1e-4, 100.0), (3e-3, 25.0))
"""Gaps of a pair and distances [d_p] of spheres that squeeze it where their gradient is cut off: a
bound without lubrication is 8 to 71 tolerances off there."""

NEAR = 0.05
"""Gap [d_p] below which the finest degrees stand for all in `crowds`."""

_FACING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""Turns the line of a cluster from z to y."""

FINE_DEGREE = 72
"""Degree of all pairs in the solve that clusters of more than two spheres are measured against."""


def gaps(tolerances, sizes=(1.0, 0.1, 1e-2, 1e-3, 1e-4), progress=None):
    """Clusters at gaps [d_p]: cluster, gap, tolerance, degree, iterations, seconds, error, ...

    error: largest of all spheres, over 24, against the exact solution for a pair and otherwise
    against a solve with FINE_DEGREE. estimate: the solver's own, largest; status: its word on it.
    """
    rows = []
    for name, shape in CLUSTERS.items():
        for gap in sizes:
            centres = (1.0 + gap) * shape
            exact = (
                forces_on_two_spheres(centres, FLOW)
                if name == "pair"
                else fine_forces(centres, FLOW, FINE_DEGREE)
            )
            for tolerance in tolerances:
                rows.append(
                    {"test": "gap", "case": name, "value": gap} | _solved(centres, exact, tolerance)
                )
                if progress is not None:
                    progress(len(rows), len(CLUSTERS) * len(sizes) * len(tolerances))
    return pd.DataFrame(rows)


def crowds(tolerances, progress=None) -> pd.DataFrame:
    """What could fool the error estimate: columns as in `gaps`, value the smallest gap [d_p].

    Nearly touching pairs and triples among far spheres that strain the flow at them, lattices, a
    chain, two clusters apart and a compact one; each against a solve with more degrees.
    """
    rows, scenes = [], list(_crowds())
    for name, centres in scenes:
        exact = fine_forces(centres, FLOW, _fine_degrees(centres))
        gap = centre_distances(centres).min() - CONTACT
        for tolerance in tolerances:
            row = {"test": "crowd", "case": name, "value": gap}
            rows.append(row | _solved(centres, exact, tolerance))
            if progress is not None:
                progress(len(rows), len(scenes) * len(tolerances))
    return pd.DataFrame(rows)


def _crowds():
    """Names and centres (n, 3) [d_p] of the scenes of `crowds`."""
    for gap, distance in LURES:
        near = (CONTACT + gap) * CLUSTERS["pair"] @ _FACING
        yield "pair and a square far off", np.vstack([near, _square(distance)])
    for item, (number, distance) in enumerate(((1, 5.0), (4, 20.0), (24, 60.0))):
        rng = stream(Purpose.STRESS, 1, CROWDS, item)
        for name in ("pair", "chain of three"):
            near = 1.003 * CLUSTERS[name] @ _FACING
            yield f"{name} among {number} far", np.vstack([near, _ring(number, distance, rng)])
    for side, spacing in ((3, 1.5), (5, 60.0)):
        axis = spacing * np.arange(side)
        yield f"lattice of {side**3}", np.array(np.meshgrid(axis, axis, axis)).reshape(3, -1).T
    yield "chain of 20", 1.1 * np.arange(20.0)[:, None] * [0.0, 1.0, 0.0]
    six = 1.05 * CLUSTERS["six"]
    yield "two clusters apart", np.vstack([six, six + np.array([3.0, 12.0, 4.0])])
    # A sphere and its twelve neighbours in the closest packing.
    twelve = [np.roll([0.0, a, b], k) for a in (-1, 1) for b in (-1, 1) for k in range(3)]
    yield "thirteen", 1.02 * np.vstack([np.zeros((1, 3)), np.sqrt(0.5) * np.array(twelve)])


def _square(distance: float) -> np.ndarray:
    """4 x 4 spheres on a square, a tenth of `distance` apart, across the line to the origin."""
    x, z = 0.1 * distance * (np.mgrid[:4, :4].reshape(2, -1) - 1.5)
    return np.column_stack([x, np.full(16, distance), z])


def _ring(number: int, distance: float, rng) -> np.ndarray:
    """Random spheres, `distance` to twice that far from the origin, 2 d_p from one another."""
    placed = np.empty((0, 3))
    while len(placed) < number:
        place = distance * rng.uniform(1.0, 2.0) * Rotation.random(rng=rng).as_matrix()[0]
        if (np.linalg.norm(placed - place, axis=1) > 2.0).all():
            placed = np.vstack([placed, place])
    return placed


def _fine_degrees(centres) -> np.ndarray:
    """Degrees beyond those of the strictest tolerance; the highest for nearly touching pairs."""
    degrees = np.minimum(plan_scene(centres, SMALLEST_TOLERANCE).degrees + 4, FINE_DEGREE)
    degrees[centre_distances(centres) < CONTACT + NEAR] = FINE_DEGREE
    return degrees


def distances(tolerances, values=(10.0, 100.0, 1e3, 1e4)) -> pd.DataFrame:
    """Pairs at large distances [d_p], against the exact solution; columns as in `gaps`."""
    rows = []
    for distance in values:
        centres = distance * CLUSTERS["pair"]
        exact = forces_on_two_spheres(centres, FLOW)
        for tolerance in tolerances:
            row = {"test": "distance", "case": "pair", "value": distance}
            rows.append(row | _solved(centres, exact, tolerance))
    return pd.DataFrame(rows)


def invariances(tolerances, gap=0.01, seed: int = 1) -> pd.DataFrame:
    """Six nearly touching spheres: moved far away, turned, and with two distances almost alike.

    error: largest change of a force, over 24, after the change is undone. Turned: largest of 10
    random rotations. Alike: one distance made larger by 1e-12 of itself, which changes the exact
    force by as little.
    """
    centres = (1.0 + gap) * CLUSTERS["six"]
    rng = stream(Purpose.STRESS, seed, TURNS)
    rows = []
    for tolerance in tolerances:

        def forces(places, flow, tolerance=tolerance):
            return fixed_spheres(places, flow, tolerance).force

        base = forces(centres, FLOW)
        for distance in (1e3, 1e6):
            moved = forces(centres + distance * np.array([1.0, -0.7, 0.4]), FLOW)
            rows.append(_change("moved [d_p]", distance, tolerance, moved - base))
        turned = []
        for turn in Rotation.random(10, rng=rng).as_matrix():
            turned.append(forces(centres @ turn.T, turn @ FLOW) @ turn - base)
        rows.append(_change("turned", np.nan, tolerance, turned))
        alike = centres.copy()
        alike[1] *= 1.0 + 1e-12
        rows.append(_change("distances alike", 1e-12, tolerance, forces(alike, FLOW) - base))
    return pd.DataFrame(rows)


def turned_mesh(edge: float = 0.5, seed: int = 1) -> pd.DataFrame:
    """The answer of a template and of the same template turned: relative change, at most."""
    mesh = sphere_mesh(edge)
    turn = Rotation.random(rng=stream(Purpose.STRESS, seed, MESH_TURN)).as_matrix()
    response = OneBody.from_mesh(mesh).response
    turned = OneBody.from_mesh(SphereMesh(mesh.vertices @ turn.T, mesh.triangles)).response
    change = np.abs(turned - response).max() / response.max()
    return pd.DataFrame(
        [{"test": "turned mesh", "case": "template", "value": edge, "error": change}]
    )


def condition_numbers(edges=(1.0, 0.7, 0.5, 0.35), sizes=(1.0, 0.1, 1e-2, 1e-3), degree=10):
    """Of the single-layer matrix against edge length [radii], and of two spheres against the gap.

    The latter is that of the preconditioned system which GMRES solves, all degrees up to `degree`.
    """
    rows = []
    for edge in edges:
        mesh = sphere_mesh(edge)
        normals = nodal_integrals(mesh, lambda n: n).ravel()
        matrix = self_interaction(mesh) + np.outer(normals, normals)
        rows.append(("condition, one body", f"{len(mesh.triangles)} elements", edge, matrix))
    for gap in sizes:
        rows.append(("condition, system", "pair", gap, _pair_system(1.0 + gap, degree)))
    return pd.DataFrame(
        [
            {"test": test, "case": case, "value": value, "condition": np.linalg.cond(matrix)}
            for test, case, value, matrix in rows
        ]
    )


def fine_forces(centres, flow, degrees) -> np.ndarray:
    """Forces (n, 3) [Re_p c_D] with the degrees that are asked for, no tolerance.

    degrees: one for all pairs, or (n, n), symmetric.
    """
    n = len(centres)
    degrees = np.array(np.broadcast_to(degrees, (n, n)))
    np.fill_diagonal(degrees, 0)
    highest = int(degrees.max())
    response, tables = _fine_tables(highest)
    force, _, _ = solve_scene(
        np.asarray(centres) / RADIUS, flow_direction(flow), degrees, response, tables, 1e-12, 600
    )
    return FORCE_UNIT * RADIUS * force


@cache
def _fine_tables(degree):
    return response_rows(exact_response(degree)), translation_tables(degree)


def _solved(centres, exact, tolerance) -> dict:
    start = time.perf_counter()
    plan = plan_scene(centres, tolerance)
    solution = solve(plan, FLOW, tolerance)
    seconds = time.perf_counter() - start
    return {
        "tolerance": tolerance,
        "degree": plan.degrees.max(),
        "iterations": solution.iterations,
        "seconds": seconds,
        "error": np.abs(solution.force - exact).max() / STOKES_DRAG,
        "estimate": solution.error_estimate.max(),
        "status": str(solution.status),
    }


def _change(case, value, tolerance, difference) -> dict:
    error = np.abs(difference).max() / STOKES_DRAG
    return {
        "test": "invariance", "case": case, "value": value, "tolerance": tolerance, "error": error
    }  # fmt: skip


def _pair_system(distance, degree) -> np.ndarray:
    """Matrix 1 + T K of two spheres at a distance [d_p], column by column."""
    tables, response = translation_tables(), response_rows(exact_response(degree))
    degrees = np.array([[0, degree], [degree, 0]])
    centres = distance / RADIUS * CLUSTERS["pair"].astype(float)
    scene = couple_scene(centres, np.ones(2), degrees, 0, NO_CLOSE_PAIRS, tables)
    columns = []
    for unit in np.eye(6 * (degree + 1) ** 2):
        column = np.empty((len(unit) // 3, 3))
        apply_system(unit.reshape(-1, 3), scene, response, tables, column)
        columns.append(column.ravel())
    return np.array(columns).T
