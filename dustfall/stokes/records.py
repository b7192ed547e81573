"""Shards of scenes: their meshes and their force records, as arrays and as HDF5 files."""

from collections.abc import Mapping, Sequence

import h5py
import numpy as np

from dustfall.files import atomic
from dustfall.stokes.solve import Plan, Response, plan_scene, solve

RECORD_UNITS = {
    "force": "Re_p c_D",
    "iterations": "1",
    "residual": "relative to the right-hand side",
    "error_estimate": "relative to the force on an isolated sphere, 24",
    "minimum_gap": "d_p",
    "status": "0 converged, 1 not converged, 2 error estimate above the tolerance",
}


def plan_shard(neighbours, tolerance: float) -> list[Plan]:
    """Plan each scene: the reference sphere at the origin, then its neighbours (m, 5, 3) [d_p]."""
    origin = np.zeros((1, 3))
    return [plan_scene(np.concatenate([origin, scene]), tolerance) for scene in neighbours]


def write_plans(path, plans: Sequence[Plan], scene, template: Mapping[str, float]) -> None:
    """Write where the spheres of a shard are and what they exchange; `template`: attributes."""
    with atomic(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(template)
        file.attrs["content"] = (
            "a template mesh at each centre; orders: degree of the harmonics that a pair "
            "exchanges; error: of each sphere's force by the degrees left out, relative to the "
            "force on an isolated sphere"
        )
        _put(file, "scene", scene, "1")
        _put(file, "centres", [plan.centres for plan in plans], "d_p")
        _put(file, "orders", [plan.orders for plan in plans], "1")
        _put(file, "error", [plan.error for plan in plans], "1")


def read_plans(path) -> tuple[list[Plan], np.ndarray]:
    """Read what `write_plans` wrote: plans and scene numbers."""
    with h5py.File(path) as file:
        columns = [file[name][:] for name in ("centres", "orders", "error")]
        return [Plan(*row) for row in zip(*columns, strict=True)], file["scene"][:]


def solve_shard(
    plans: Sequence[Plan], response: Response, tolerance: float, progress=None
) -> dict[str, np.ndarray]:
    """Solve each planned scene in the unit flow along y; one array for each name in RECORD_UNITS.

    force is (m, n, 3) and error_estimate (m, n), sphere by sphere; the other arrays are (m,).
    """
    solutions = []
    for plan in plans:
        solutions.append(solve(plan, response, tolerance=tolerance))
        if progress is not None:
            progress(len(solutions), len(plans))
    return {name: np.array([getattr(s, name) for s in solutions]) for name in RECORD_UNITS}


def write_records(path, records: dict[str, np.ndarray], scene) -> None:
    """Write the force records of a shard."""
    with atomic(path) as temporary, h5py.File(temporary, "w") as file:
        _put(file, "scene", scene, "1")
        for name, unit in RECORD_UNITS.items():
            _put(file, name, records[name], unit)


def _put(file, name, values, unit) -> None:
    stored = file.create_dataset(name, data=np.asarray(values), track_times=False)
    stored.attrs["unit"] = unit
