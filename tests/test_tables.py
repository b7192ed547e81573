"""Tables hold the same numbers in every kind of file, and say what is wrong with a file."""

import h5py
import numpy as np
import pytest

from dustfall.tables import Quantity, read_table, write_table

SCENES = {
    "neighbours": Quantity((None, 3), "d_p", "neighbours"),
    "force": Quantity((3,), "Re_p c_D", "force"),
    "weight": Quantity((), "1", "of a scene", required=False),
}
RNG = np.random.default_rng(3)
VALUES = {
    "neighbours": RNG.normal(size=(7, 4, 3)) * 10.0 ** RNG.integers(-200, 200, (7, 4, 3)),
    "force": RNG.normal(size=(7, 3)),
    "weight": RNG.random(7),
}


@pytest.mark.parametrize("suffix", ["csv", "txt", "npy", "h5"])
@pytest.mark.parametrize("names", [["neighbours", "force", "weight"], ["neighbours", "force"]])
def test_what_was_written_is_read_to_the_last_bit(tmp_path, suffix, names):
    path = tmp_path / f"table.{suffix}"
    write_table(path, {name: SCENES[name] for name in names}, VALUES)
    found = read_table(path, SCENES)
    assert list(found) == names
    for name in names:
        np.testing.assert_array_equal(found[name], VALUES[name])


def test_a_csv_names_components_with_their_units(tmp_path):
    path = tmp_path / "table.csv"
    two = VALUES | {"neighbours": VALUES["neighbours"][:, :2]}
    write_table(path, SCENES, two)
    names = [f"{axis}{k} [d_p]" for k in (1, 2) for axis in "xyz"]
    forces = [f"force_{axis} [Re_p c_D]" for axis in "xyz"]
    assert path.read_text().splitlines()[0] == ",".join([*names, *forces, "weight"])


@pytest.mark.parametrize("separator", [",", " ", "\t", " , "])
def test_columns_without_names_are_taken_in_order(tmp_path, separator):
    rows = np.hstack([VALUES[name].reshape(7, -1) for name in ("neighbours", "force")])
    lines = [separator.join(map(repr, row)) for row in rows.tolist()]
    (tmp_path / "table.dat").write_text("# a comment\n\n" + "\n".join(lines) + " # another\n")
    found = read_table(tmp_path / "table.dat", SCENES)
    np.testing.assert_array_equal(found["neighbours"], VALUES["neighbours"])
    np.testing.assert_array_equal(found["force"], VALUES["force"])


def test_named_columns_may_stand_in_any_order_among_others(tmp_path):
    text = "id,force_z,force_x [Re_p c_D],force_y,z1,y1 [d_p],x1\n9,3,1,2,6,5,4\n"
    (tmp_path / "table.csv").write_text("\ufeff" + text, encoding="utf-8")
    found = read_table(tmp_path / "table.csv", SCENES)
    np.testing.assert_array_equal(found["force"], [[1, 2, 3]])
    np.testing.assert_array_equal(found["neighbours"], [[[4, 5, 6]]])


def test_plain_arrays_and_datasets_of_others_are_read(tmp_path):
    np.save(tmp_path / "cube.npy", VALUES["neighbours"])
    np.save(tmp_path / "flat.npy", VALUES["neighbours"].reshape(7, 12))
    seen = {"neighbours": SCENES["neighbours"]}
    for name in ("cube.npy", "flat.npy"):
        found = read_table(tmp_path / name, seen)
        np.testing.assert_array_equal(found["neighbours"], VALUES["neighbours"])
    with h5py.File(tmp_path / "plain.h5", "w") as file:
        file["neighbours"], file["force"] = VALUES["neighbours"], VALUES["force"]
    np.testing.assert_array_equal(
        read_table(tmp_path / "plain.h5", SCENES)["force"], VALUES["force"]
    )


START = {"position": Quantity((3,), "d_p", ""), "velocity": Quantity((3,), "v_s", "", False)}


@pytest.mark.parametrize("names", ["v_x,v_y,v_z", "vx,vy,vz", "Vel_x,Vel_y,Vel_z", "velocity,s,t"])
def test_an_optional_quantity_of_another_name_is_not_passed_over(tmp_path, names):
    (tmp_path / "start.csv").write_text(f"x,y,z,{names}\n1,2,3,4,5,6\n")
    told = "but no velocity: if it is that, velocity_x, velocity_y, velocity_z is needed"
    with pytest.raises(ValueError, match=rf"start\.csv: there is a column {names[:2]}.*, {told}"):
        read_table(tmp_path / "start.csv", START)


@pytest.mark.parametrize("suffix", ["csv", "npy", "h5"])
def test_what_one_table_holds_is_read_as_another_that_needs_less_of_it(tmp_path, suffix):
    more = {
        "position": START["position"],
        "force": Quantity((3,), "Re_p c_D", "force"),
        "error_estimate": Quantity((), "1", "error"),
    }
    values = {"position": VALUES["force"], "force": VALUES["force"]}
    values["error_estimate"] = VALUES["weight"]
    write_table(tmp_path / f"table.{suffix}", more, values)
    assert list(read_table(tmp_path / f"table.{suffix}", START)) == ["position"]


BAD_TEXT = {
    "": "the table is empty",
    "# nothing\n": "the table is empty",
    "x1,y1,z1,force_x,force_y,force_z\n": "names, but no row",
    "x1,y1,z1,force_x,force_y\n1,2,3,4,5\n": "no column force_z among x1, y1, z1, force_x",
    "x1,y1,z1,force_x,force_y,force_z,weight_x\n1,2,3,4,5,6\n": "7 names for 6 columns",
    "x1,y1,z1,x2,force_x,force_y,force_z\n1,2,3,4,5,6,7\n": "no column y2",
    "x1,y1,z1,x3,y3,z3,force_x,force_y,force_z\n1,2,3,4,5,6,7,8,9\n": "column x3 beside x1, y1, z1",
    "x1,y1,z1,X2,Y2,Z2,force_x,force_y,force_z\n1,2,3,4,5,6,7,8,9\n": "column X2 beside x1, y1, z1",
    "x1,y1,z1,force_x,force_y,force_z,weights\n1,2,3,4,5,6,7\n": "column weights, but no weight: ",
    "x1,x1\n1,2\n": "two columns x1",
    "x1 [mm],y1,z1,force_x,force_y,force_z\n1,2,3,4,5,6\n": r"x1 is in mm: d_p is needed",
    "x1,y1,z1,force_x,force_y,force_z\n1,2,3,4,5,six\n": "could not convert string 'six'",
    "1,2,3\n": r"3 columns without names are not neighbours \(rows, k, 3\), force \(rows, 3\)",
    "1,2,3,4,5,6,7,8\n": "8 columns without names",
    "1,2,3,4,5,6\n1,2\n": "number of columns changed from 6 to 2",
}


@pytest.mark.parametrize(("text", "told"), BAD_TEXT.items(), ids=range(len(BAD_TEXT)))
def test_text_that_is_no_such_table_is_refused_by_name(tmp_path, text, told):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"table\.csv: .*{told}"):
        read_table(path, SCENES)


def write_npy(path, array):
    np.save(path, array, allow_pickle=True)


def write_hdf5(path, change):
    with h5py.File(path, "w") as file:
        for name, array in (VALUES | change).items():
            if isinstance(array, np.ndarray):
                file[name] = array
        file["force"].attrs["units"] = change.get("units", "Re_p c_D")


BAD_FILES = [
    ("pickle.npy", write_npy, np.array([{}]), "Python objects"),
    ("line.npy", write_npy, np.zeros(6), r"an array \(6,\) is not"),
    ("empty.npy", write_npy, np.zeros((0, 6)), "the table is empty"),
    ("names.npy", write_npy, np.zeros(2, [("neighbours", "f8", (5, 3))]), "there is no force"),
    (
        "weights.npy",
        write_npy,
        np.zeros(2, [("neighbours", "f8", (5, 3)), ("force", "f8", 3), ("weights", "f8")]),
        "there is a column weights, but no weight: if it is that, weight is needed",
    ),
    ("text.npy", write_npy, np.full((2, 6), "a"), "could not convert"),
    ("lacking.h5", write_hdf5, {"neighbours": None}, "there is no neighbours"),
    ("misspelt.h5", write_hdf5, {"weight": None, "weigth": np.ones(7)}, "weigth, but no weight: "),
    ("short.h5", write_hdf5, {"force": np.zeros((6, 3))}, "different lengths"),
    ("flat.h5", write_hdf5, {"neighbours": np.zeros((7, 12))}, r"\(7, 12\), not \(rows, k, 3\)"),
    ("metres.h5", write_hdf5, {"units": "N"}, "force is in N: Re_p c_D is needed"),
]


@pytest.mark.parametrize(("name", "write", "content", "told"), BAD_FILES)
def test_arrays_that_are_no_such_table_are_refused_by_name(tmp_path, name, write, content, told):
    write(tmp_path / name, content)
    with pytest.raises(ValueError, match=rf"{name}: .*{told}"):
        read_table(tmp_path / name, SCENES)


@pytest.mark.parametrize("name", ["damaged.npy", "damaged.h5", "damaged.csv"])
def test_damaged_files_are_refused_by_name(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x93NUMPY\xff\x00\x89HDF")
    with pytest.raises(ValueError, match=name):
        read_table(tmp_path / name, SCENES)
    with pytest.raises(FileNotFoundError, match=f"no file .*{name}"):
        read_table(tmp_path / "elsewhere" / name, SCENES)


def test_a_table_is_written_by_a_suffix_that_is_known(tmp_path):
    with pytest.raises(ValueError, match=r"allowed are \.csv, \.txt, \.npy, \.h5"):
        write_table(tmp_path / "table.xlsx", SCENES, VALUES)
    assert not list(tmp_path.iterdir())
