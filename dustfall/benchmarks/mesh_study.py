"""Drag on an isolated sphere against mesh size, and what the grid convergence index makes of it."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from dustfall.stokes.elements.boundary_elements import SCHEMES, forces_by_elements
from dustfall.stokes.elements.mesh import LARGEST_SIZE, SphereMesh, sphere_mesh
from dustfall.stokes.elements.outer_sphere import exact_drag_in_outer_sphere, forces_in_outer_sphere
from dustfall.units import STOKES_DRAG

PAPER_FORMULATION = "paper's formulation (flat, outer sphere)"

OUTER_COARSENING = 1.9
"""Edges of the outer sphere over those of the particle: leaves 77 % of the nodes on the particle,
as in the mesh that the paper chose."""

GALERKIN_DOWN_TO = 0.25
"""Edge length [radii] below which the Galerkin schemes are left out: their error is then that of
rounding and quadrature, and their matrices outgrow a small machine."""

TOLERANCE = 1e-8
"""Of quadrature and solve, so that what the study shows is the mesh."""

ISOLATED = np.zeros((1, 3))


def mesh_study(sizes: Sequence[float], progress=None) -> pd.DataFrame:
    """Drag on an isolated sphere for the paper's formulation, every scheme and edge length [radii].

    Returns the columns scheme, size [radii], nodes (vertices of all meshes), share (of the nodes on
    the particle), elements, force and limit, the exact force of the formulation [Re_p c_D]: 24, or
    with the outer sphere 24.053.
    """
    rows = []
    for done, size in enumerate(sorted(sizes, reverse=True), start=1):
        mesh = sphere_mesh(size)
        outer = sphere_mesh(min(OUTER_COARSENING * size, LARGEST_SIZE))
        force = forces_in_outer_sphere(ISOLATED, mesh, outer, tolerance=TOLERANCE)[0, 1]
        rows.append(_row(PAPER_FORMULATION, size, [mesh, outer], force))
        for scheme in SCHEMES:
            if "Galerkin" in scheme and size < GALERKIN_DOWN_TO:
                continue
            force = forces_by_elements(ISOLATED, mesh, scheme, tolerance=TOLERANCE)[0, 1]
            rows.append(_row(scheme, size, [mesh], force))
        if progress is not None:
            progress(done, len(sizes))
    return pd.DataFrame(rows)


def _row(scheme: str, size: float, meshes: Sequence[SphereMesh], force: float) -> dict:
    nodes = [len(mesh.vertices) for mesh in meshes]
    return {
        "scheme": scheme,
        "size": size,
        "nodes": sum(nodes),
        "share": nodes[0] / sum(nodes),
        "elements": sum(len(mesh.triangles) for mesh in meshes),
        "force": force,
        "limit": exact_drag_in_outer_sphere() if scheme == PAPER_FORMULATION else STOKES_DRAG,
    }


def grid_convergence(cell_size, value) -> dict[str, float]:
    """Observed order, extrapolated value and grid convergence index (Celik et al. 2008).

    cell_size, value: of three meshes, finest first. Returns order, extrapolated (from the two
    finest), approximate_error, extrapolated_error and gci (relative, safety factor 1.25).
    order is NaN, and all else with it, where the equation for it has no solution (two values
    equal, or no order between 0.01 and 50).
    Raises ValueError unless there are three cell sizes that grow and three finite values.
    """
    h, f = np.asarray(cell_size, dtype=float), np.asarray(value, dtype=float)
    if h.shape != (3,) or f.shape != (3,) or not (0 < h[0] < h[1] < h[2]):
        raise ValueError(f"three cell sizes, finest first, and three values: not {h}, {f}")
    if not np.isfinite(f).all():
        raise ValueError(f"values must be finite, not {f}")
    r21, r32 = h[1] / h[0], h[2] / h[1]
    e21, e32 = f[1] - f[0], f[2] - f[1]
    names = ("order", "extrapolated", "approximate_error", "extrapolated_error", "gci")
    if e21 == 0.0 or e32 == 0.0:
        return dict.fromkeys(names, np.nan)
    sign = np.sign(e32 / e21)

    def equation(p):
        q = np.log((r21**p - sign) / (r32**p - sign))
        return abs(np.log(abs(e32 / e21)) + q) / np.log(r21) - p

    low, high = 0.01, 50.0
    if equation(low) * equation(high) > 0.0:
        return dict.fromkeys(names, np.nan)
    p = brentq(equation, low, high)
    extrapolated = (r21**p * f[0] - f[1]) / (r21**p - 1.0)
    approximate = abs(e21 / f[0])
    return {
        "order": p,
        "extrapolated": extrapolated,
        "approximate_error": approximate,
        "extrapolated_error": abs((extrapolated - f[0]) / extrapolated),
        "gci": 1.25 * approximate / (r21**p - 1.0),
    }


def convergence_table(study: pd.DataFrame) -> pd.DataFrame:
    """`grid_convergence` of every three successive meshes of a scheme; cell size is nodes^(-1/2).

    Returns scheme, nodes and force (of the finest of the three) and what `grid_convergence` gives.
    """
    rows = []
    for scheme, group in study.groupby("scheme", sort=False):
        group = group.sort_values("nodes", ascending=False)
        for start in range(len(group) - 2):
            three = group.iloc[start : start + 3]
            finest = {"scheme": scheme, **three.iloc[0][["nodes", "force"]]}
            rows.append(finest | grid_convergence(three["nodes"] ** -0.5, three["force"]))
    return pd.DataFrame(rows)
