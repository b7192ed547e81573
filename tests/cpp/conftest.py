"""The C interface, compiled with g++ alone, and models of every kind for it."""

import ctypes
import shutil
import subprocess
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from dustfall.forces.export import export_json
from dustfall.forces.features import KINDS, block_inputs
from dustfall.forces.learned import INPUTS, LearnedModel, Network, block_widths
from dustfall.units import COMPONENTS

CPP = Path(__file__).parents[2] / "cpp"
BUILDS = {"portable": ("-O2",), "native": ("-O3", "-march=native")}
STRICT = ("-fno-math-errno", "-Wall", "-Wextra", "-Wpedantic", "-Werror")

LAYERS = {"decomposed": "7-6/5", "dense": "9-5", "pairwise": "6"}


class Library:
    """`dustfall.h` by ctypes, with arrays and errors as Python has them."""

    def __init__(self, path):
        self._library = ctypes.CDLL(str(path))
        self._library.dustfall_load.restype = ctypes.c_void_p
        for name in ("error", "name", "hash"):
            getattr(self._library, f"dustfall_{name}").restype = ctypes.c_char_p

    def load(self, path):
        """Return the model in a JSON file; ValueError with the library's sentence."""
        model = self._library.dustfall_load(str(path).encode())
        if model is None:
            raise ValueError(self._library.dustfall_error().decode())
        return ctypes.c_void_p(model)

    def describe(self, model):
        """Return number of neighbours, name and hash of a model."""
        texts = (getattr(self._library, f"dustfall_{name}")(model) for name in ("name", "hash"))
        return self._library.dustfall_neighbours(model), *(text.decode() for text in texts)

    def predict(self, model, neighbours):
        """Return the force (m, 3)."""
        force = np.empty((len(neighbours), 3))
        self._call("predict", model, len(neighbours), neighbours, force)
        return force

    def drag(self, model, flow, neighbours, at_rest):
        """Return beta (m,) and side (m, 3)."""
        beta, side = np.empty(len(flow)), np.empty((len(flow), 3))
        self._call("drag", model, len(flow), flow, neighbours, np.array(at_rest), beta, side)
        return beta, side

    def nearest(self, positions, period, number=5):
        """Return vectors (n, number, 3) and rows (n, number)."""
        vectors = np.full((len(positions), number, 3), np.nan)
        rows = np.full((len(positions), number), -1, np.int64)
        period = np.asarray(period, float)
        count = ctypes.c_int(number)
        self._call("nearest", len(positions), positions, period, count, vectors, rows)
        return vectors, rows

    def _call(self, name, *arguments):
        passed, kept = [], []
        for argument in arguments:
            if isinstance(argument, int):
                argument = ctypes.c_int64(argument)
            elif isinstance(argument, np.ndarray):
                kept.append(np.ascontiguousarray(argument))
                argument = kept[-1].ctypes.data_as(ctypes.c_void_p)
            passed.append(argument)
        if getattr(self._library, f"dustfall_{name}")(*passed):
            raise ValueError(self._library.dustfall_error().decode())


@pytest.fixture(scope="session")
def compile_with():
    """A function that runs a compiler, or skips the test where there is none."""

    def compile_with(compiler, *arguments):
        if shutil.which(compiler) is None:
            pytest.skip(f"there is no {compiler} on this machine")
        done = subprocess.run([compiler, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return compile_with


@pytest.fixture(scope="session")
def built(compile_with, tmp_path_factory):
    """A function that compiles one of the builds, once."""

    @cache
    def built(build):
        path = tmp_path_factory.mktemp("library") / "libdustfall.so"
        source, flags = CPP / "dustfall.cpp", (*BUILDS[build], *STRICT)
        compile_with("g++", "-std=c++11", *flags, "-fPIC", "-shared", source, "-o", path)
        return path

    return built


@pytest.fixture(scope="session", params=BUILDS)
def library(request, built):
    """The C interface for any processor, and for this one with its fused products."""
    return Library(built(request.param))


@pytest.fixture(scope="session")
def exported_model(library, tmp_path_factory):
    """A function that gives the library a model of this package."""
    folder = tmp_path_factory.mktemp("models")

    def load(model, neighbours=5):
        export_json(model, folder / "model.json", neighbours)
        return library.load(folder / "model.json")

    return load


def random_model(kind, radial_input="logarithm", largest_distance=60.0, neighbours=5):
    """A learned model of any kind with random weights, large enough for its forces to matter."""
    rng = np.random.default_rng(7)
    layout = KINDS[kind]
    layers = dict.fromkeys(COMPONENTS, LAYERS[layout.blocks])
    features = INPUTS[layout.unit_vectors]
    networks = {}
    for component in COMPONENTS:
        blocks = [
            [
                (rng.normal(size=(narrow, wide)), rng.normal(size=narrow))[: 2 - (last == depth)]
                for depth, (wide, narrow) in enumerate(pairwise(widths))
            ]
            for widths in block_widths(kind, layers[component], component, neighbours)
            for last in [len(widths) - 2]
        ]
        mean, scale = rng.normal(size=features), rng.uniform(0.5, 2.0, features)
        given = block_inputs(layout.blocks, neighbours)
        networks[component] = Network(component, given, blocks, mean, scale, 2.0)
    header = {
        "kind": kind,
        "neighbours": neighbours,
        "layers": layers,
        "radial_input": radial_input,
        "largest_distance": largest_distance,
    }
    return LearnedModel(header, networks)
