"""Shards of scenes: solved one after the other, and their force records as HDF5 files."""

import h5py
import numpy as np

from dustfall.files import atomic
from dustfall.stokes.plan import plan_scene
from dustfall.stokes.solve import solve

RECORD_UNITS = {
    "force": "Re_p c_D",
    "iterations": "1",
    "residual": "relative to the right-hand side",
    "error_estimate": "relative to the force on an isolated sphere, 24",
    "minimum_gap": "d_p",
    "status": "",
    "degrees": "1",
}
"""Columns of a record; degrees: highest of the harmonics that each pair of spheres exchanges."""


def solve_shard(neighbours, tolerance: float, progress=None) -> dict[str, np.ndarray]:
    """Solve each scene in the unit flow along y; one array for each name in RECORD_UNITS.

    neighbours: (m, k, 3) [d_p], around a reference sphere at the origin, which comes first in what
    is returned. With n = k + 1, force is (m, n, 3), error_estimate (m, n) and degrees (m, n, n);
    the other arrays are (m,), status of str.
    """
    reference = np.zeros((1, 3))
    plans, solutions = [], []
    for scene in neighbours:
        plans.append(plan_scene(np.concatenate([reference, scene]), tolerance))
        solutions.append(solve(plans[-1], tolerance=tolerance))
        if progress is not None:
            progress(len(solutions), len(neighbours))
    names = [name for name in RECORD_UNITS if name != "degrees"]
    records = {name: np.array([getattr(s, name) for s in solutions]) for name in names}
    return records | {"degrees": np.array([plan.degrees for plan in plans])}


def write_records(path, records: dict[str, np.ndarray], scene) -> None:
    """Write the force records of a shard, and the numbers (m,) of its scenes."""
    with atomic(path) as temporary, h5py.File(temporary, "w") as file:
        _put(file, "scene", scene, "1")
        for name, unit in RECORD_UNITS.items():
            values = records[name]
            _put(file, name, values.astype(bytes) if name == "status" else values, unit)


def _put(file, name, values, unit) -> None:
    stored = file.create_dataset(name, data=np.asarray(values), track_times=False)
    stored.attrs["units"] = unit
