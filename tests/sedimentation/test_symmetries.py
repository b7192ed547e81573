"""What may not matter to a run: where the origin is, which way x and y point, how many copies."""

import numpy as np
import pytest

from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.forces.learned import load_model
from dustfall.sedimentation import box_length, random_positions
from tests.sedimentation.runs import run

SIDE = box_length(100, 1e-3)
POSITIONS = random_positions(np.random.default_rng(1), 100, 1e-3)
VELOCITIES = [0, 0, -1] + 0.2 * np.random.default_rng(2).normal(size=(100, 3))

ABOUT_GRAVITY = {
    "quarter turn": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    "half turn": [[-1, 0, 0], [0, -1, 0], [0, 0, 1]],
    "mirror": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "exchange of x and y": [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
}


def coordinates(folder, model, positions, velocities):
    trajectory, _ = run(folder, model, positions=positions, velocities=velocities, duration=1.0)
    return trajectory.coordinates.values


# Models that have all symmetries of Stokes flow; the paper's network has not.
@pytest.mark.parametrize("model", [ROTNE_PRAGER, load_model()], ids=lambda model: model.name)
@pytest.mark.parametrize("symmetry", ABOUT_GRAVITY)
def test_motion_keeps_the_symmetries_of_the_cube_about_gravity(tmp_path, model, symmetry):
    turn = np.array(ABOUT_GRAVITY[symmetry], dtype=float)
    here = coordinates(tmp_path, model, POSITIONS, VELOCITIES)
    there = coordinates(tmp_path, model, POSITIONS @ turn.T, VELOCITIES @ turn.T)
    np.testing.assert_allclose(there, here @ turn.T, atol=1e-7)


def test_motion_is_the_same_from_any_origin_and_image(tmp_path):
    here = coordinates(tmp_path, ROTNE_PRAGER, POSITIONS, VELOCITIES)
    rng = np.random.default_rng(3)
    shift = [2.3, -71.1, 40.2] + SIDE * rng.integers(-2, 3, size=(100, 3))
    there = coordinates(tmp_path, ROTNE_PRAGER, POSITIONS + shift, VELOCITIES)
    np.testing.assert_allclose(there - shift, here, atol=1e-9)


def test_the_number_of_a_particle_does_not_matter(tmp_path):
    order = np.random.default_rng(4).permutation(100)
    here = coordinates(tmp_path, ROTNE_PRAGER, POSITIONS, VELOCITIES)
    there = coordinates(tmp_path, ROTNE_PRAGER, POSITIONS[order], VELOCITIES[order])
    np.testing.assert_array_equal(there, here[:, order])


def test_eight_copies_of_a_cube_move_as_one(tmp_path):
    # The motion depends on n through the random start alone: the periodic cloud is the same.
    copies = SIDE * np.stack(np.meshgrid(*3 * [[0, 1]]), -1).reshape(-1, 1, 3)
    here = coordinates(tmp_path, ROTNE_PRAGER, POSITIONS, VELOCITIES)
    there = coordinates(
        tmp_path, ROTNE_PRAGER, (POSITIONS + copies).reshape(-1, 3), np.tile(VELOCITIES, (8, 1)),
    )  # fmt: skip
    expected = (here[:, None] + copies).reshape(len(here), -1, 3)
    np.testing.assert_allclose(there, expected, atol=1e-8)
