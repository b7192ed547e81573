"""The data set joins shards in one order, keeps what converged and refuses what is wrong."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from dustfall.columns import write_columns
from dustfall.dataset import Dataset, Shard, aggregate, check, read, split, summary, write
from dustfall.scenes import SCENE_COLUMNS
from dustfall.solution import Status
from dustfall.stokes.records import write_records

NUMBERS = {"uniform": 23, "ball": 10}


def campaign() -> Dataset:
    """Scenes with spread-out neighbours and made-up forces, in the order of a data set."""
    rng = np.random.default_rng(5)
    m = sum(NUMBERS.values())
    neighbours = rng.normal(size=(m, 5, 3)) * 10
    distance = np.linalg.norm(neighbours, axis=2)
    neighbours = np.take_along_axis(neighbours, distance.argsort(axis=1)[:, :, None], axis=1)
    return Dataset(
        neighbours,
        rng.normal([0, 20, 0], size=(m, 3)),
        10 ** rng.uniform(-8, -3, m),
        np.repeat(list(NUMBERS), list(NUMBERS.values())),
        np.concatenate([np.arange(number) for number in NUMBERS.values()]),
    )


def write_shards(folder, data: Dataset, size: int, unconverged=()) -> list[Shard]:
    shards = []
    for law in NUMBERS:
        rows = np.flatnonzero(data.radial_law == law)
        for first in range(0, len(rows), size):
            part = data.select(rows[first : first + size])
            shard = Shard(
                law, folder / f"{law}-{first}-{size}.h5", folder / f"{law}-{first}-{size}.solved.h5"
            )
            values = {name: getattr(part, name) for name in SCENE_COLUMNS}
            write_columns(shard.scenes, SCENE_COLUMNS, values)
            status = [
                Status.NOT_CONVERGED if (law, k) in unconverged else Status.OUT_OF_REACH
                for k in part.scene
            ]
            others = np.full((len(part), 5, 3), 99.0)  # must not get into the data set
            records = {
                "scene": part.scene,
                "force": np.concatenate([part.force[:, None], others], axis=1),
                "status": np.array(status),
                "error_estimate": np.arange(6.0 * len(part)).reshape(-1, 6),
                "degrees": np.zeros((len(part), 6, 6)),
                **{
                    name: np.arange(len(part), dtype=float)
                    for name in ("iterations", "residual", "minimum_gap")
                },
            }
            write_records(shard.solutions, records, part.scene)
            shards.append(shard)
    return shards


def assert_same(one: Dataset, other: Dataset):
    for name in ("neighbours", "force", "volume_fraction", "radial_law", "scene"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("size", [4, 10, 100])
def test_shard_size_and_order_do_not_show(tmp_path, size):
    data = campaign()
    shards = write_shards(tmp_path, data, size)
    joined, _ = aggregate(shards[::-1], NUMBERS)
    assert_same(joined, data)


def test_files_of_equal_data_are_equal(tmp_path):
    for size in (4, 100):
        joined, _ = aggregate(write_shards(tmp_path, campaign(), size), NUMBERS)
        write(tmp_path / f"{size}.h5", joined, {"seed": 5})
    assert (tmp_path / "4.h5").read_bytes() == (tmp_path / "100.h5").read_bytes()


def test_what_is_written_is_read_with_units(tmp_path):
    data = campaign()
    write(tmp_path / "forces.h5", data, {"seed": 5, "phi_range": [1e-8, 1e-3]})
    assert_same(read(tmp_path / "forces.h5"), data)
    with h5py.File(tmp_path / "forces.h5") as file:
        assert file["neighbours"].attrs["units"] == "d_p"
        assert file["force"].attrs["units"] == "Re_p c_D"
        assert file.attrs["seed"] == 5


def test_unconverged_scenes_are_counted_and_left_out(tmp_path):
    data = campaign()
    left_out = {("uniform", 7), ("ball", 0)}
    joined, solve = aggregate(write_shards(tmp_path, data, 6, left_out), NUMBERS)
    assert len(joined) == len(data) - 2
    assert not left_out & set(zip(joined.radial_law, joined.scene, strict=True))
    gone = solve[~solve["converged"]]
    assert set(zip(gone["radial_law"], gone["scene"], strict=True)) == left_out
    assert summary(joined, solve)["unconverged"].sum() == 2


def test_a_campaign_of_which_nothing_converged_is_refused(tmp_path):
    data = campaign()
    unconverged = set(zip(data.radial_law, data.scene, strict=True))
    with pytest.raises(ValueError, match="none of 33 scenes converged"):
        aggregate(write_shards(tmp_path, data, 10, unconverged), NUMBERS)


def test_summary_counts_every_scene_once_in_its_decade(tmp_path):
    data = replace(campaign(), volume_fraction=np.resize([1e-8, 9.9e-8, 1e-7, 1e-5], 33))
    table = summary(*aggregate(write_shards(tmp_path, data, 6), NUMBERS))
    counts = table.groupby("decade")["scenes"].sum()
    assert counts.to_dict() == {-8: 17, -7: 8, -5: 8}
    row = table[(table["radial_law"] == "ball") & (table["decade"] == -5)].iloc[0]
    chosen = (data.radial_law == "ball") & (data.volume_fraction == 1e-5)
    assert row["streamwise_min"] == data.force[chosen, 1].min()
    assert row["vertical_variance"] == pytest.approx(data.force[chosen, 2].var(ddof=1))


def test_missing_and_repeated_shards_are_refused(tmp_path):
    shards = write_shards(tmp_path, campaign(), 6)
    with pytest.raises(ValueError, match=r"uniform has 17 scenes.*scene 0 is missing"):
        aggregate(shards[1:], NUMBERS)
    with pytest.raises(ValueError, match="ball has 14 scenes, 10 of them different"):
        aggregate([*shards, shards[-1]], NUMBERS)


def test_solutions_of_other_scenes_are_refused(tmp_path):
    shards = write_shards(tmp_path, campaign(), 6)
    swapped = replace(shards[0], solutions=shards[1].solutions)
    with pytest.raises(ValueError, match="does not solve the scenes"):
        aggregate([swapped, *shards[1:]], NUMBERS)


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (lambda d: d.force.__setitem__((3, 1), np.nan), "force of scene 3 of radial law uniform"),
        (lambda d: d.volume_fraction.__setitem__(30, np.inf), "scene 7 of radial law ball"),
        (lambda d: d.neighbours.__setitem__(4, d.neighbours[4, ::-1].copy()), "not sorted"),
        (lambda d: d.neighbours.__setitem__(9, d.neighbours[2]), "scene 2 .*more than once"),
    ],
)
def test_damaged_data_are_refused(damage, sentence):
    data = campaign()
    check(data)
    damage(data)
    with pytest.raises(ValueError, match=sentence):
        check(data)


def test_split_parts_all_scenes_and_depends_on_the_seed():
    data = campaign()
    training, test = split(data, 0.2, seed=1)
    assert (len(training), len(test)) == (26, 7)
    both = np.concatenate([training.force, test.force])
    assert {tuple(row) for row in both} == {tuple(row) for row in data.force}
    assert_same(split(data, 0.2, seed=1)[1], test)
    assert not np.array_equal(split(data, 0.2, seed=2)[1].force, test.force)
    with pytest.raises(ValueError, match=r"share of 0\.01"):
        split(data, 0.01, seed=1)
