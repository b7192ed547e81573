"""Drag on an isolated sphere against mesh size, and what the grid convergence index makes of it."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from dustfall.stokes.boundary_elements import SCHEMES, forces_by_elements
from dustfall.stokes.mesh import sphere_mesh

ISOLATED = np.zeros((1, 3))


def mesh_study(sizes: Sequence[float], progress=None) -> pd.DataFrame:
    """Drag on an isolated sphere for every scheme and edge length [radii].

    Returns the columns scheme, size [radii], nodes (vertices of the mesh), elements and
    force [Re_p c_D].
    """
    rows = []
    for size in sorted(sizes, reverse=True):
        mesh = sphere_mesh(size)
        for scheme in SCHEMES:
            force = forces_by_elements(ISOLATED, mesh, scheme, tolerance=1e-8)[0, 1]
            rows.append((scheme, size, len(mesh.vertices), len(mesh.triangles), force))
            if progress is not None:
                progress(len(rows), len(sizes) * len(SCHEMES))
    return pd.DataFrame(rows, columns=["scheme", "size", "nodes", "elements", "force"])


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
    """`grid_convergence` of every scheme's three finest meshes; cell size is nodes^(-1/2)."""
    rows = []
    for scheme, group in study.groupby("scheme", sort=False):
        finest = group.sort_values("nodes", ascending=False).head(3)
        if len(finest) == 3:
            index = grid_convergence(finest["nodes"] ** -0.5, finest["force"])
            rows.append({"scheme": scheme, **index})
    return pd.DataFrame(rows)
