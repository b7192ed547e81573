"""The header gives the forces of the Python package, an implementation of its own."""

import ctypes

import numpy as np
import pytest

from dustfall.forces import load_model
from dustfall.forces.features import KINDS, RADIAL_INPUTS
from dustfall.forces.formulas import FORMULAS
from dustfall.sedimentation.closures.nearest_neighbours import drag_coefficients
from tests.cpp.conftest import random_model
from tests.forces.scenes import random_neighbours

ROUNDING = 1e-10  # Re_p c_D

ERRORS = 0x01 | 0x04 | 0x08  # FE_INVALID, FE_DIVBYZERO and FE_OVERFLOW of x86-64


def edge_scenes():
    """Scenes where a rule decides: contact, overlap, exact ties, planes, and far out of range."""
    scenes = random_neighbours(40, seed=2, nearest=1.0, farthest=20.0)
    scenes[0] /= np.linalg.norm(scenes[0], axis=1, keepdims=True)
    scenes[1] *= 0.3 / np.linalg.norm(scenes[1], axis=1, keepdims=True)
    scenes[2, 0] *= 1e-6
    for flips, row in (([1, -1, 1], 3), ([-1, 1, 1], 4), ([1, 1, -1], 5), ([-1, -1, -1], 6)):
        scenes[row, 1] = scenes[row, 0] * flips
        scenes[row, 3] = scenes[row, 2] * flips
    scenes[7, 1:] = scenes[7, 0] * np.array([[-1.0], [2.0], [-2.0], [3.0]])
    scenes[8, :, 1] = 0.0
    scenes[9, :, [0, 2]] = 0.0
    scenes[10, :, 0] = scenes[10, :, 2] = 0.0
    scenes[11, :2, 1] = 1e-12
    scenes[12, :3] = [[0.0, 2.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 2.0]]
    scenes[13, 1] = scenes[13, 0]
    scenes[14] *= 1e4
    scenes[15] *= 1e8
    scenes[16, 2:] *= 1e6
    scenes[17] = np.rint(scenes[17])
    scenes[17, :, 1] += scenes[17, :, 1] == 0.0
    return scenes


def permuted_coordinates(number):
    """Scenes of neighbours at exactly equal distances: one vector's coordinates in any order."""
    rng = np.random.default_rng(5)
    vector = rng.uniform(1.0, 4.0, (number, 3))
    orders = ([0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0])
    scenes = np.stack([vector[:, order] for order in orders], axis=1)
    return scenes * rng.choice([-1.0, 1.0], (number, 5, 1))


SCENES = {
    "random": lambda: random_neighbours(333, seed=1),
    "edges": edge_scenes,
    "ties": lambda: permuted_coordinates(200),
}


@pytest.mark.parametrize("scenes", SCENES)
@pytest.mark.parametrize("radial_input", RADIAL_INPUTS)
@pytest.mark.parametrize("kind", KINDS)
def test_learned_models_of_every_kind_predict_as_in_python(
    kind, radial_input, scenes, library, exported_model
):
    model, neighbours = random_model(kind, radial_input), SCENES[scenes]()
    predicted = library.predict(exported_model(model), neighbours)
    np.testing.assert_allclose(predicted, model.predict(neighbours), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("scenes", SCENES)
@pytest.mark.parametrize("formula", FORMULAS)
def test_closed_formulas_predict_as_in_python(formula, scenes, library, exported_model):
    model, neighbours = FORMULAS[formula], SCENES[scenes]()
    predicted = library.predict(exported_model(model), neighbours)
    np.testing.assert_allclose(predicted, model.predict(neighbours), rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        *((kind, number) for kind in ("reflections", "anchored_pairwise") for number in (1, 4, 14)),
        *(("anchored", number) for number in (3, 6, 14)),
    ],
)
def test_any_number_of_neighbours_is_predicted_as_in_python(kind, number, library, exported_model):
    model = FORMULAS.get(kind) or random_model(kind, neighbours=number)
    neighbours = random_neighbours(41, seed=8, number=number)
    predicted = library.predict(exported_model(model, number), neighbours)
    np.testing.assert_allclose(predicted, model.predict(neighbours), rtol=0, atol=ROUNDING)


@pytest.fixture(scope="module")
def shipped(exported_model):
    return exported_model(load_model())


def test_the_model_that_ships_predicts_as_in_python_and_says_what_it_is(library, shipped):
    neighbours = np.concatenate([make() for make in SCENES.values()])
    expected = load_model().predict(neighbours)
    np.testing.assert_allclose(
        library.predict(shipped, neighbours), expected, rtol=0, atol=ROUNDING
    )
    neighbours, name, digest = library.describe(shipped)
    assert (neighbours, name, len(digest)) == (5, "anchored", 64)


def test_a_scene_has_the_same_force_in_any_batch(library, shipped):
    neighbours = random_neighbours(37)
    together = library.predict(shipped, neighbours)
    alone = np.concatenate([library.predict(shipped, scene[None]) for scene in neighbours])
    np.testing.assert_array_equal(together, alone)


def test_no_scene_raises_a_floating_point_exception(library, shipped):
    """Programs that trap them, as OpenFOAM does, would die."""
    mathematics = ctypes.CDLL("libm.so.6")
    neighbours = np.concatenate([make() for make in SCENES.values()])
    mathematics.feclearexcept(ERRORS)
    library.predict(shipped, neighbours)
    assert mathematics.fetestexcept(ERRORS) == 0


@pytest.mark.parametrize("tilt", [1.0, 1e-3, 1e-9, 1e-12, 1e-15, 0.0])
@pytest.mark.parametrize("along", [1.0, -1.0])
def test_drag_in_flow_of_any_direction_is_as_in_python(along, tilt, library, shipped):
    rng = np.random.default_rng(3)
    velocity = tilt * rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-3, 3, (60, 1))
    velocity[:, 1] += along
    velocity[0] = 0.0
    neighbours = random_neighbours(60, seed=4)
    beta, side = library.drag(shipped, -velocity, neighbours, [0.0, 0.0, 1.0])
    expected_beta, expected_side = drag_coefficients(load_model(), velocity, neighbours)
    speed = 1 + np.linalg.norm(velocity, axis=1, keepdims=True)
    np.testing.assert_allclose(24 * beta, 24 * expected_beta, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(24 * side / speed, 24 * expected_side / speed, rtol=0, atol=ROUNDING)
    assert (side[0] == 0.0).all()


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (0.0, "neighbour 2 of scene 1 is at the centre of the reference sphere"),
        (np.nan, "neighbour 2 of scene 1 is not at a finite distance"),
        (1e200, "neighbour 2 of scene 1 is not at a finite distance"),
    ],
)
def test_a_neighbour_without_direction_or_place_is_refused(value, sentence, library, shipped):
    neighbours = random_neighbours(3)
    neighbours[1, 2] = value
    with pytest.raises(ValueError, match=sentence):
        library.predict(shipped, neighbours)
