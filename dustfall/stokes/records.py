"""Shards of scenes: solved one after the other, and their force records as HDF5 files."""

import numpy as np

from dustfall.columns import Column, write_columns
from dustfall.stokes.methods import fixed_spheres
from dustfall.stokes.plan import plan_scene
from dustfall.stokes.solve import solve

COLUMNS = {
    "scene": Column("1", "number of the scene within its radial law"),
    "force": Column("Re_p c_D", "force on each sphere, the reference sphere first"),
    "error_estimate": Column("1", "of each sphere's force, over that on an isolated sphere, 24"),
    "iterations": Column("1", "of GMRES"),
    "residual": Column("1", "relative to the right-hand side"),
    "minimum_gap": Column("d_p", "smallest distance of two surfaces"),
    "status": Column("", "how the solve ended"),
    "degrees": Column(
        "1", "highest degree of the harmonics that each pair exchanges, 0 by methods without them"
    ),
}
"""Columns of a shard of force records."""


def solve_shard(
    neighbours, tolerance: float, progress=None, method: str = "multipole"
) -> dict[str, np.ndarray]:
    """Solve each scene in the unit flow along y; one array for each of COLUMNS but the scene.

    neighbours: (m, k, 3) [d_p], around a reference sphere at the origin, which comes first in what
    is returned. With n = k + 1, force is (m, n, 3), error_estimate (m, n) and degrees (m, n, n);
    the other arrays are (m,), status of str. method: as in `fixed_spheres`.
    """
    reference = np.zeros((1, 3))
    degrees, solutions = [], []
    for scene in neighbours:
        centres = np.concatenate([reference, scene])
        if method == "multipole":
            plan = plan_scene(centres, tolerance)
            solution = solve(plan, tolerance=tolerance)
            degrees.append(plan.degrees)
        else:
            solution = fixed_spheres(centres, tolerance=tolerance, method=method)
            degrees.append(np.zeros((len(centres), len(centres)), dtype=int))
        solutions.append(solution)
        if progress is not None:
            progress(len(solutions), len(neighbours))
    names = [name for name in COLUMNS if name not in ("scene", "degrees")]
    records = {name: np.array([getattr(s, name) for s in solutions]) for name in names}
    return records | {"degrees": np.array(degrees)}


def write_records(path, records: dict[str, np.ndarray], scene) -> None:
    """Write the force records of a shard, and the numbers (m,) of its scenes."""
    write_columns(path, COLUMNS, records | {"scene": scene})
