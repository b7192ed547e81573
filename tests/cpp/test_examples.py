"""The examples in C and Fortran compile as they say, and give the drag of the Python package."""

import subprocess

import numpy as np
import pytest

from dustfall.forces import load_model
from dustfall.forces.export import export_json
from dustfall.sedimentation.closures.nearest_neighbours import drag_coefficients
from dustfall.sedimentation.neighbours import nearest_neighbours
from tests.cpp.conftest import CPP


@pytest.mark.parametrize(
    ("compiler", "source"), [("gcc", "settling.c"), ("gfortran", "settling.f90")]
)
def test_example_gives_the_drag_of_the_package(compiler, source, compile_with, tmp_path):
    objects = [tmp_path / "example.o", tmp_path / "dustfall.o"]
    place = [f"-I{CPP}", f"-J{tmp_path}"] if compiler == "gfortran" else [f"-I{CPP}"]
    compile_with(compiler, "-Wall", *place, "-c", CPP / "examples" / source, "-o", objects[0])
    compile_with("g++", "-O1", "-c", CPP / "dustfall.cpp", "-o", objects[1])
    compile_with(compiler, *objects, "-lstdc++", "-lm", "-o", tmp_path / "example")
    model = load_model()
    export_json(model, tmp_path / "model.json")
    done = subprocess.run(
        [tmp_path / "example", tmp_path / "model.json"], capture_output=True, text=True, check=True
    )
    printed = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)

    i = np.arange(8)
    positions = np.stack([i % 3 * 3.0, i // 3 * 2.5, i], axis=1)
    velocity = np.tile([0.0, 0.0, -1.0], (8, 1))
    beta, side = drag_coefficients(model, velocity, nearest_neighbours(positions, 9.0)[0])
    np.testing.assert_allclose(printed, np.column_stack([beta, side]), rtol=0, atol=1e-11)


def test_an_example_without_a_model_says_so(compile_with, tmp_path):
    program = tmp_path / "example"
    compile_with("gcc", f"-I{CPP}", "-c", CPP / "examples" / "settling.c", "-o", tmp_path / "c.o")
    compile_with("g++", "-O0", tmp_path / "c.o", CPP / "dustfall.cpp", "-o", program)
    done = subprocess.run([program, "nowhere.json"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "there is no file nowhere.json" in done.stderr
