"""Shards of scenes: their meshes and their force records, as arrays and as HDF5 files."""

from collections.abc import Sequence

import h5py
import numpy as np

from dustfall.files import atomic
from dustfall.stokes.many_body import Plan, plan_scene, solve
from dustfall.stokes.one_body import OneBody

RECORD_UNITS = {
    "force": "Re_p c_D",
    "iterations": "1",
    "residual": "relative to the right-hand side",
    "error_estimate": "relative to the force on an isolated sphere, 24",
    "minimum_gap": "d_p",
    "status": "0 converged, 1 not converged",
}


def plan_shard(neighbours, sizes: Sequence[float], tolerance: float) -> list[Plan]:
    """Plan each scene: the reference sphere at the origin, then its neighbours (m, 5, 3) [d_p]."""
    origin = np.zeros((1, 3))
    return [plan_scene(np.concatenate([origin, scene]), sizes, tolerance) for scene in neighbours]


def write_plans(path, plans: Sequence[Plan], scene, sizes: Sequence[float]) -> None:
    """Write the meshes of a shard: which template at which centre, how each pair is coupled."""
    with atomic(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["template_sizes"] = list(sizes)
        file.attrs["content"] = (
            "template: number in template_sizes (edge length in radii); orders: degree of the "
            "harmonics that a pair exchanges, -1 where it is integrated element by element; "
            "error: bound of the relative force error by orders dropped and by the meshes"
        )
        _put(file, "scene", scene, "1")
        _put(file, "centres", [plan.centres for plan in plans], "d_p")
        _put(file, "template", [plan.template for plan in plans], "1")
        _put(file, "orders", [plan.orders for plan in plans], "1")
        _put(file, "error", [plan.error for plan in plans], "1")


def read_plans(path) -> tuple[list[Plan], np.ndarray]:
    """Read what `write_plans` wrote: plans and scene numbers."""
    with h5py.File(path) as file:
        columns = [file[name][:] for name in ("centres", "template", "orders", "error")]
        plans = [Plan(*row[:3], float(row[3])) for row in zip(*columns, strict=True)]
        return plans, file["scene"][:]


def solve_shard(
    plans: Sequence[Plan], bodies: Sequence[OneBody], tolerance: float, progress=None
) -> dict[str, np.ndarray]:
    """Solve each planned scene in the unit flow along y; one array for each name in RECORD_UNITS.

    force is (m, n, 3), sphere by sphere; the other arrays are (m,).
    """
    solutions = []
    for plan in plans:
        solutions.append(solve(plan, bodies, tolerance=tolerance))
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
