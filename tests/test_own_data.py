"""A data set of one's own: one content by whatever file, and refusals that name what is wrong."""

import h5py
import numpy as np
import pandas as pd
import pytest

from dustfall.cli import main
from dustfall.dataset import OWN_LAW, read, split, write
from dustfall.forces import load_model
from dustfall.own_data import read_own_data, shape
from dustfall.scenes import random_scenes


def columns(scenes=12, seed=1) -> dict[str, np.ndarray]:
    neighbours, phi = random_scenes(seed, "ball", range(scenes), (1e-4, 1e-3))
    force = np.random.default_rng(seed).normal(size=(scenes, 3))
    return {"neighbours": neighbours, "force": force, "volume_fraction": phi}


def with_one_at(distance: float) -> np.ndarray:
    neighbours = columns()["neighbours"]
    neighbours[3, 2] *= distance / np.linalg.norm(neighbours[3, 2])
    return neighbours


def write_csv(path, values):
    k = values["neighbours"].shape[1]
    table = {
        f"{axis}{j + 1}": values["neighbours"][:, j, i]
        for j in range(k)
        for i, axis in enumerate("xyz")
    }
    table |= {f"force_{axis}": values["force"][:, i] for i, axis in enumerate("xyz")}
    table |= {name: own for name, own in values.items() if name not in ("neighbours", "force")}
    pd.DataFrame(table).to_csv(path, index=False)
    return path


def write_hdf5(path, values):
    with h5py.File(path, "w") as file:
        for name, own in values.items():
            file[name] = own
    return path


WAYS = {"data.csv": write_csv, "data.h5": write_hdf5}


@pytest.fixture(params=WAYS)
def make(request, tmp_path):
    return lambda values: WAYS[request.param](tmp_path / request.param, values)


def test_both_formats_give_every_bit_of_the_arrays(make):
    values = columns() | {"weight": np.arange(1.0, 13.0), "reynolds": np.full(12, 0.3)}
    path = make(values)
    dataset, reynolds = read_own_data(path)
    for name in ("neighbours", "force", "volume_fraction", "weight"):
        np.testing.assert_array_equal(getattr(dataset, name), values[name], err_msg=name)
    np.testing.assert_array_equal(reynolds, values["reynolds"])
    assert shape(path) == (12, 5)


def test_neighbours_come_in_any_order(make):
    values = columns()
    dataset, _ = read_own_data(make(values | {"neighbours": values["neighbours"][:, ::-1]}))
    np.testing.assert_array_equal(dataset.neighbours, values["neighbours"])


def test_neighbours_may_touch_up_to_the_digits_of_a_file(make):
    neighbours = with_one_at(1 - 5e-6)
    dataset, _ = read_own_data(make(columns() | {"neighbours": neighbours}))
    np.testing.assert_array_equal(dataset.neighbours[3, 0], neighbours[3, 2])


def test_without_a_volume_fraction_five_neighbours_have_that_of_the_paper(make):
    values = columns()
    phi = values.pop("volume_fraction")
    np.testing.assert_allclose(read_own_data(make(values))[0].volume_fraction, phi, rtol=1e-12)


def test_the_campaign_takes_it_as_its_own_with_weights_and_without(make, tmp_path):
    for values in (columns(), columns() | {"weight": np.arange(1.0, 13.0)}):
        dataset, _ = read_own_data(make(values))
        write(tmp_path / "forces.h5", dataset, {})
        found = read(tmp_path / "forces.h5")
        assert found.columns().keys() == dataset.columns().keys()
        training, test = split(found, 0.25, seed=1)
        assert (len(training), len(test)) == (9, 3)
        assert set(training.radial_law) == {OWN_LAW}
        if "weight" in values:
            np.testing.assert_array_equal(training.weight, training.scene + 1.0)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"weight": np.zeros(12)}, "weight must be 12 finite values above 0"),
        ({"volume_fraction": np.full(12, np.nan)}, "volume_fraction must be 12 finite values"),
        ({"force": np.full((12, 3), np.inf)}, "force of scene 0 of radial law own is not finite"),
        ({"neighbours": np.zeros((12, 5, 3))}, "centre of the reference sphere"),
        (
            {"neighbours": 25e-6 * columns()["neighbours"]},
            "60 of 60 neighbours overlap the reference sphere, .*: these look like metres",
        ),
        (
            {"neighbours": with_one_at(0.5)},
            r"1 of 60 neighbours overlap the reference sphere, the nearest is 0\.5 .* is needed$",
        ),
    ],
)
def test_values_that_cannot_be_are_refused_with_the_name_of_the_file(make, change, sentence):
    path = make(columns() | change)
    with pytest.raises(ValueError, match=rf"{path.name}: .*{sentence}"):
        read_own_data(path)


def test_a_file_without_a_scene_is_refused(make):
    path = make({name: values[:0] for name, values in columns().items()})
    with pytest.raises(ValueError, match=rf"{path.name}: there is no scene"):
        read_own_data(path)


def test_what_a_prediction_writes_is_a_data_set(tmp_path):
    np.save(tmp_path / "scenes.npy", columns()["neighbours"])
    written = tmp_path / "forces.csv"
    assert main(["predict", str(tmp_path / "scenes.npy"), "-o", str(written)]) == 0
    dataset, _ = read_own_data(written)
    assert shape(written) == columns()["neighbours"].shape[:2]
    np.testing.assert_allclose(load_model().predict(dataset.neighbours), dataset.force, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is no table"),
        ("x1,y1,z1,force_x,force_y\n1,2,3,4,5\n", "has no column force_z"),
        ("x1,y1,z1,x3,y3,z3,force_x,force_y,force_z\n", "has no column x2, y2, z2"),
        ("x1 [mm],y1,z1,force_x,force_y,force_z\n1,2,3,4,5,6\n", "has x1 in mm: d_p is needed"),
        ("x1,y1,z1,force_x,force_y,force_z,phi\n", "has a column phi; allowed are x1"),
        ("x1,y1,z1,force_x,force_y,force_z\n1,2,3,4,5,many\n", "holds what is no number"),
    ],
)
def test_tables_without_the_columns_are_refused(tmp_path, text, sentence):
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"data\.csv {sentence}"):
        read_own_data(path)


@pytest.mark.parametrize("row", ["0,1,2,3,4,5,6", "1,2,3,4,5,6,", "0,0,1,2,3,4,5,6"])
def test_rows_of_more_fields_than_there_are_names_are_refused(tmp_path, row):
    path = tmp_path / "data.csv"
    path.write_text(f"x1,y1,z1,force_x,force_y,force_z\n{row}\n{row}\n")
    sentence = rf"data\.csv names 6 columns, but its rows have {row.count(',') + 1} fields"
    for look in (shape, read_own_data):
        with pytest.raises(ValueError, match=sentence):
            look(path)


def test_files_that_are_missing_or_something_else_are_refused(tmp_path):
    for name in ("none.csv", "none.h5"):
        for look in (shape, read_own_data):
            with pytest.raises(FileNotFoundError, match=f"there is no file .*{name}"):
                look(tmp_path / name)
    (tmp_path / "text.h5").write_text("no data")
    with pytest.raises(ValueError, match="neither CSV"):
        shape(tmp_path / "text.h5")
    write_hdf5(tmp_path / "other.h5", {"force": np.zeros((3, 3))})
    with pytest.raises(ValueError, match="has no dataset neighbours with 3 axes"):
        shape(tmp_path / "other.h5")
