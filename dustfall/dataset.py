"""The data set that force models learn from: scenes and the force on their reference sphere.

Scenes are solved in shards; the data set joins them in the order of radial law and scene number,
so that neither the size of a shard nor the order of the jobs shows in it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd

from dustfall.columns import Column, read_columns, write_columns
from dustfall.scenes import LAWS, SCENE_COLUMNS
from dustfall.solution import Status
from dustfall.streams import Purpose, stream

OWN_LAW = "own"
"""In place of a radial law, of scenes that were not drawn here."""

SOLUTION_COLUMNS = (
    "scene", "force", "status", "error_estimate", "iterations", "residual", "minimum_gap",
)  # fmt: skip
"""Columns of a shard of force records that the data set reads."""

COLUMNS = {
    "neighbours": SCENE_COLUMNS["neighbours"],
    "force": Column("Re_p c_D", "force on the reference sphere; an isolated one feels 24 along y"),
    "volume_fraction": SCENE_COLUMNS["volume_fraction"],
    "radial_law": Column("", "law that the distances of the neighbours were drawn by"),
    "scene": SCENE_COLUMNS["scene"],
}
"""Columns of the data set."""

WEIGHT = {"weight": Column("1", "weight of the scene in training, where scenes have any")}


@dataclass(frozen=True)
class Dataset:
    """Scenes with their forces.

    neighbours: (m, k, 3) [d_p], sorted by distance; x spanwise, y streamwise, z vertical.
    force: (m, 3) [Re_p c_D]. volume_fraction: (m,). radial_law: (m,) of str. scene: (m,) numbers
    within each radial law. weight: (m,), in training; None: all alike.
    """

    neighbours: np.ndarray
    force: np.ndarray
    volume_fraction: np.ndarray
    radial_law: np.ndarray
    scene: np.ndarray
    weight: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.scene)

    def select(self, which) -> "Dataset":
        """The scenes that an index array or a mask names."""
        return Dataset(**{name: values[which] for name, values in self.columns().items()})

    def columns(self) -> dict[str, np.ndarray]:
        """The arrays by name; without weights where there are none."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: values for name, values in found.items() if values is not None}

    def of_laws(self, laws: Iterable[str]) -> "Dataset":
        """The scenes of some radial laws. Raises ValueError if there are none."""
        laws = list(laws)
        which = np.isin(self.radial_law, laws)
        if not which.any():
            raise ValueError(f"the data set has no scenes of radial law {', '.join(laws)}")
        return self.select(which)


@dataclass(frozen=True)
class Shard:
    """Where the scenes of one shard and their solutions lie."""

    radial_law: str
    scenes: Path
    solutions: Path


def aggregate(shards: Iterable[Shard], numbers: Mapping[str, int]):
    """Join the shards of a campaign.

    numbers: scenes that each radial law must have, numbered from 0.

    Returns the converged scenes as a Dataset, ordered by radial law (in the order of `numbers`) and
    scene, and a DataFrame of all scenes with columns radial_law, scene, volume_fraction,
    converged, iterations, residual, error_estimate, minimum_gap.
    Raises ValueError if scenes are missing, occur twice, or differ between a scene file and its
    solutions, if none converged, or if `check` objects.
    """
    parts, solves = [], []
    for shard in shards:
        part, solve = _read_shard(shard)
        parts.append(part)
        solves.append(solve)
    joined = Dataset(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in COLUMNS}
    )
    solve = pd.concat(solves, ignore_index=True)

    rank = np.array([list(numbers).index(law) for law in joined.radial_law])
    order = np.lexsort((joined.scene, rank))
    joined, solve = joined.select(order), solve.iloc[order].reset_index(drop=True)
    for law, number in numbers.items():
        found = joined.scene[joined.radial_law == law]
        if not np.array_equal(found, np.arange(number)):
            missing = np.setdiff1d(np.arange(number), found)
            raise ValueError(
                f"radial law {law} has {len(found)} scenes, {len(np.unique(found))} of them "
                f"different; it must have each of {number} scenes once"
                + (f" (scene {missing[0]} is missing)" if len(missing) else "")
            )
    if not solve["converged"].any():
        raise ValueError(f"none of {len(solve)} scenes converged: a data set needs one at least")
    dataset = joined.select(solve["converged"].to_numpy())
    check(dataset)
    return dataset, solve


def check(dataset: Dataset) -> None:
    """Raise ValueError unless there are scenes, all finite, of sorted neighbours and different."""
    if len(dataset) == 0:
        raise ValueError("there is no scene: a data set needs one at least")
    for name in ("neighbours", "force", "volume_fraction"):
        values = getattr(dataset, name).reshape(len(dataset), -1)
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise ValueError(f"{name} of {_name(dataset, bad[0])} is not finite: {values[bad[0]]}")
    distance = np.linalg.norm(dataset.neighbours, axis=2)
    bad = np.flatnonzero((np.diff(distance, axis=1) < 0).any(axis=1))
    if len(bad):
        raise ValueError(
            f"neighbours of {_name(dataset, bad[0])} are not sorted by distance: "
            f"{distance[bad[0]]} d_p"
        )
    _, first, count = np.unique(
        dataset.neighbours.reshape(len(dataset), -1), axis=0, return_index=True, return_counts=True
    )
    if (count > 1).any():
        repeated = first[count > 1].min()
        raise ValueError(f"{_name(dataset, repeated)} occurs more than once")


def split(dataset: Dataset, share: float, seed: int) -> tuple[Dataset, Dataset]:
    """Part the scenes at random into training and test scenes, `share` of each law in the latter.

    Both keep the order of `dataset`; which scenes of a law are in which depends on the seed and
    that law alone. The neighbours of each scene come in random order, for all models alike: the
    data set has them sorted, which would tell the order to models that do not sort. Raises
    ValueError if share lies outside ]0, 1[ or a part would lack a law.
    """
    test = np.zeros(len(dataset), bool)
    neighbours = dataset.neighbours.copy()
    for law in np.unique(dataset.radial_law):
        rows = np.flatnonzero(dataset.radial_law == law)
        number = round(share * len(rows))
        if not (0 < share < 1 and 0 < number < len(rows)):
            raise ValueError(
                f"a test share of {share} of {len(rows)} scenes of radial law {law} leaves no "
                "scene on one side"
            )
        item = [*LAWS, OWN_LAW].index(law)
        test[stream(Purpose.TEST_SCENES, seed, item).permutation(rows)[:number]] = True
        # Row k is that of scene k, whichever scenes are here.
        draws = stream(Purpose.NEIGHBOUR_ORDER, seed, item)
        scene = dataset.scene[rows]
        order = draws.random((scene.max() + 1, neighbours.shape[1]))[scene].argsort(axis=1)
        neighbours[rows] = np.take_along_axis(neighbours[rows], order[:, :, None], axis=1)
    shuffled = replace(dataset, neighbours=neighbours)
    return shuffled.select(~test), shuffled.select(test)


def write(path: Path, dataset: Dataset, provenance: Mapping[str, object]) -> None:
    """Write `dataset` as HDF5, with units and `provenance` as attributes.

    Equal data give equal files: no time stamp goes in.
    """
    frame = {"frame": "x spanwise, y streamwise, z vertical; the flow is along +y"}
    columns = COLUMNS if dataset.weight is None else COLUMNS | WEIGHT
    write_columns(path, columns, dataset.columns(), frame | dict(provenance))


def read(path: Path) -> Dataset:
    """Read a data set that `write` wrote. Raises ValueError for a damaged file."""
    return Dataset(**read_columns(path, COLUMNS, WEIGHT))


def summary(dataset: Dataset, solve: pd.DataFrame | None = None) -> pd.DataFrame:
    """Table per radial law and decade of phi: counts, force statistics, effort of the solve.

    dataset and solve are what `aggregate` returns; without a solve there are counts and forces
    alone. A row has 10^decade <= phi < 10^(decade+1).
    Forces in Re_p c_D, gaps in d_p.
    """
    decade = ["radial_law", "decade"]
    spanwise, streamwise, vertical = dataset.force.T
    forces = pd.DataFrame(
        {
            "radial_law": dataset.radial_law,
            "decade": _decade(dataset.volume_fraction),
            "streamwise": streamwise,
            "spanwise": spanwise,
            "vertical": vertical,
        }
    )
    statistics = forces.groupby(decade).agg(
        streamwise_mean=("streamwise", "mean"),
        streamwise_min=("streamwise", "min"),
        streamwise_variance=("streamwise", "var"),
        spanwise_variance=("spanwise", "var"),
        vertical_variance=("vertical", "var"),
    )
    if solve is None:
        table = forces.groupby(decade).agg(scenes=("streamwise", "size"))
    else:
        solve = solve.assign(decade=_decade(solve["volume_fraction"]))
        table = solve.groupby(decade, sort=False).agg(
            scenes=("scene", "size"),
            unconverged=("converged", lambda converged: int((~converged).sum())),
            iterations_median=("iterations", "median"),
            iterations_max=("iterations", "max"),
            error_estimate_max=("error_estimate", "max"),
            gap_min=("minimum_gap", "min"),
        )
    return table.join(statistics).sort_index().reset_index()


def _read_shard(shard: Shard) -> tuple[Dataset, pd.DataFrame]:
    scenes = read_columns(shard.scenes, SCENE_COLUMNS)
    solutions = read_columns(shard.solutions, SOLUTION_COLUMNS)
    number = scenes["scene"]
    if not np.array_equal(number, solutions["scene"]):
        raise ValueError(f"{shard.solutions} does not solve the scenes of {shard.scenes}")
    law = np.full(len(number), shard.radial_law)
    part = Dataset(force=solutions["force"][:, 0], radial_law=law, **scenes)
    solve = pd.DataFrame(
        {
            "radial_law": law,
            "scene": number,
            "volume_fraction": part.volume_fraction,
            # A mesh that is out of reach of a gap leaves no force.
            "converged": (solutions["status"] != Status.NOT_CONVERGED)
            & np.isfinite(part.force).all(axis=1),
            "error_estimate": solutions["error_estimate"][:, 0],
            **{name: solutions[name] for name in ("iterations", "residual", "minimum_gap")},
        }
    )
    return part, solve


def _decade(phi) -> np.ndarray:
    # Rounded first, so that a phi of 1e-5 up to its last bit opens its own decade.
    return np.floor(np.round(np.log10(phi), 12)).astype(int)


def _name(dataset: Dataset, index: int) -> str:
    return f"scene {dataset.scene[index]} of radial law {dataset.radial_law[index]}"
