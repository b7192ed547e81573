"""Stress tests of the solver's numerical stability: each returns a table of what it measured."""

import time
from collections.abc import Callable
from functools import cache, partial

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
from dustfall.stokes.references.fundamental_solutions import reference_forces
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

NEAR_GAPS = (3e-3, 0.3)
"""Range of the gaps [d_p] of nearly touching spheres in `crowds`, log-uniform."""

FAR = (4.0, 1000.0)
"""Range of the distances [d_p] of far spheres from them, log-uniform."""

MOST_FAR = 24
"""Largest number of far spheres."""

FINE_DEGREE = 72
"""Degree of all pairs in the solve that clusters of more than two spheres are measured against."""

RESOLVED = 9.0
"""Degrees times root of the gap [d_p] that leave out 1e-11: harmonics n fade as exp(-n xi) each
way, cosh(xi) the distance."""

PEER_SPHERES, PEER_GAP = 27, 0.05
"""Most spheres and least gap [d_p] of the scenes that fundamental solutions answer in seconds."""

PEER_TOLERANCE = 1e-7
"""That they are asked for."""

PEER_SCENES = 0.25
"""Share of the scenes of a family, at least one, that they answer too, where they can."""


def gaps(tolerances, sizes=(1.0, 0.1, 1e-2, 1e-3, 1e-4), progress=None):
    """Clusters at gaps [d_p]: cluster, gap, tolerance, degree, iterations, seconds, error, ...

    error: largest of all spheres, over 24, against the exact solution for a pair and otherwise
    against a solve with FINE_DEGREE. estimate: the solver's own, largest; status: its word on it.
    """
    rows = []
    # What is compiled on the first call is none of its seconds.
    _solved(2.0 * CLUSTERS["pair"], np.zeros((2, 3)), tolerances[0])
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


def crowds(tolerances, number: int, seed: int = 1, progress=None) -> pd.DataFrame:
    """What could fool the error estimate: columns as in `gaps`, value the smallest gap [d_p].

    `number` random scenes of the families that have a share of 1 in FAMILIES, of others in
    proportion, at least one, and those of LURES; each against a solve with more degrees. scene:
    number within the family. spheres: how many. difference: of that solve and of fundamental
    solutions, which share no code with it, over 24, and peer_estimate: the error that these
    estimate of themselves; both where they answer, on the row of the first tolerance.
    """
    rows = []
    scenes = list(_crowds(number, seed))
    for case, item, peer, centres in scenes:
        exact = fine_forces(centres, FLOW, _fine_degrees(centres))
        gap = centre_distances(centres).min() - CONTACT
        compared = {}
        if peer and len(centres) <= PEER_SPHERES and gap >= PEER_GAP:
            forces, estimate = reference_forces(centres, FLOW, PEER_TOLERANCE)
            difference = np.abs(forces - exact).max() / STOKES_DRAG
            compared = {"difference": difference, "peer_estimate": estimate}
        for tolerance in tolerances:
            row = {"test": "crowd", "case": case, "value": gap}
            row |= {"scene": item, "spheres": len(centres)}
            rows.append(row | _solved(centres, exact, tolerance) | compared)
            compared = {}
            if progress is not None:
                progress(len(rows), len(scenes) * len(tolerances))
    return pd.DataFrame(rows)


def _crowds(number: int, seed: int):
    """Family, number, whether fundamental solutions are asked too, and centres (n, 3) [d_p]."""
    for item, (gap, distance) in enumerate(LURES):
        near = _line([gap])
        yield "lure", item, False, np.vstack([near, _patch(16, distance) @ _along_flow().T])
    for family, (name, (share, scene)) in enumerate(FAMILIES.items()):
        count = max(round(share * number), 1)
        for item in range(count):
            rng = stream(Purpose.STRESS, seed, CROWDS, family, item)
            yield name, item, item < max(PEER_SCENES * count, 1), scene(rng)


def _among_far(rng, spheres: int) -> np.ndarray:
    """Nearly touching spheres, and far ones anywhere."""
    return _with_far(rng, _grown(rng, spheres, NEAR_GAPS))


def _among_lures(rng, spheres: int) -> np.ndarray:
    """Nearly touching spheres on a line along the flow; far ones side by side, which squeeze it.

    They lie on the line, where the gradient of their flow is largest, or anywhere.
    """
    near = _line(_log_uniform(rng, NEAR_GAPS, spheres - 1))
    # From there on the patch is beyond the line's end, and its spheres do not overlap.
    distance = _log_uniform(rng, (15.0, FAR[1]))
    turn = _along_flow() if rng.random() < 0.5 else _turn(rng)
    return np.vstack([near, _patch(rng.integers(1, MOST_FAR + 1), distance) @ turn.T])


def _lattice(rng, side: int, spacings) -> np.ndarray:
    """side^3 spheres on a cubic lattice, turned."""
    axis = _log_uniform(rng, spacings) * np.arange(side)
    return np.array(np.meshgrid(axis, axis, axis)).reshape(3, -1).T @ _turn(rng).T


def _chain(rng, spheres: int, gaps) -> np.ndarray:
    """Spheres on a line, one gap between all, turned."""
    return _line(np.full(spheres - 1, _log_uniform(rng, gaps))) @ _turn(rng).T


def _two_clusters(rng) -> np.ndarray:
    """Two clusters of four to six spheres, some distance apart."""
    one, other = (_grown(rng, rng.integers(4, 7), (0.05, 0.5)) for _ in range(2))
    # No cluster reaches further than its spheres in a row.
    return np.vstack([one, other + (18.0 + _log_uniform(rng, (1.0, 200.0))) * _turn(rng)[0]])


def _thirteen(rng) -> np.ndarray:
    """A sphere and its twelve neighbours in the closest packing, a gap of 0.02 apart, turned."""
    twelve = [np.roll([0.0, a, b], k) for a in (-1, 1) for b in (-1, 1) for k in range(3)]
    return 1.02 * np.vstack([np.zeros((1, 3)), np.sqrt(0.5) * np.array(twelve)]) @ _turn(rng).T


FAMILIES: dict[str, tuple[float, Callable[..., np.ndarray]]] = {
    "pair among far": (1.0, partial(_among_far, spheres=2)),
    "triple among far": (1.0, partial(_among_far, spheres=3)),
    "pair among lures": (1.0, partial(_among_lures, spheres=2)),
    "triple among lures": (1.0, partial(_among_lures, spheres=3)),
    "two clusters": (0.5, _two_clusters),
    "lattice of 27": (0.3, partial(_lattice, side=3, spacings=(1.2, 100.0))),
    "chain of 20": (0.2, partial(_chain, spheres=20, gaps=(0.1, 10.0))),
    "lattice of 125": (0.1, partial(_lattice, side=5, spacings=(5.0, 100.0))),
    "thirteen": (0.01, _thirteen),
}
"""Families of `crowds`: share of the number of scenes, which is smaller for what takes longer, and
what draws a scene."""


def _grown(rng, spheres: int, gaps) -> np.ndarray:
    """Spheres that each nearly touch one that is there already."""
    centres = np.zeros((1, 3))
    while len(centres) < spheres:
        apart = CONTACT + _log_uniform(rng, gaps)
        candidate = centres[rng.integers(len(centres))] + apart * _turn(rng)[0]
        if np.linalg.norm(centres - candidate, axis=1).min() >= CONTACT + gaps[0]:
            centres = np.vstack([centres, candidate])
    return centres


def _with_far(rng, near) -> np.ndarray:
    """Far spheres, 1 to MOST_FAR, around near ones, at least 2 d_p from any."""
    centres, spheres = near, len(near) + rng.integers(1, MOST_FAR + 1)
    while len(centres) < spheres:
        candidate = _log_uniform(rng, FAR) * _turn(rng)[0]
        if np.linalg.norm(centres - candidate, axis=1).min() > 2.0:
            centres = np.vstack([centres, candidate])
    return centres


def _line(gaps) -> np.ndarray:
    """Spheres on a line along the flow, the first at the origin, these gaps [d_p] apart."""
    places = np.concatenate([[0.0], np.cumsum(CONTACT + np.asarray(gaps))])
    return places[:, None] * FLOW


def _patch(number: int, distance: float) -> np.ndarray:
    """Spheres on a square across the x axis, a tenth of `distance` apart, at x = `distance`."""
    side = int(np.ceil(np.sqrt(number)))
    places = 0.1 * distance * (np.mgrid[:side, :side].reshape(2, -1).T[:number] - 0.5 * (side - 1))
    return np.column_stack([np.full(number, distance), places])


def _along_flow() -> np.ndarray:
    """A matrix (3, 3) that turns x into the flow."""
    across = np.cross(FLOW, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    return np.column_stack([FLOW, across, np.cross(FLOW, across)])


def _turn(rng) -> np.ndarray:
    """A random rotation (3, 3)."""
    return Rotation.random(rng=rng).as_matrix()


def _log_uniform(rng, limits, size=None):
    """A number between two limits, its logarithm uniform."""
    return np.exp(rng.uniform(*np.log(limits), size))


def _fine_degrees(centres) -> np.ndarray:
    """Degrees beyond those of the strictest tolerance, and those that resolve each gap."""
    degrees = plan_scene(centres, SMALLEST_TOLERANCE).degrees + 4
    gaps = np.maximum(centre_distances(centres) - CONTACT, 1e-9)
    return np.minimum(np.maximum(degrees, np.ceil(RESOLVED / np.sqrt(gaps))), FINE_DEGREE).astype(
        int
    )


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
