"""What may not matter to a run: where the origin is, which way x and y point, how many copies."""

import numpy as np
import pytest
import xarray as xr

from dustfall.forces.learned import load_model
from dustfall.forces.rotne_prager import RotnePrager
from dustfall.sedimentation import Properties, cube_side, random_positions, settle

SIDE = cube_side(100, 1e-3)
POSITIONS = random_positions(np.random.default_rng(1), 100, 1e-3)
VELOCITIES = [0, 0, -1] + 0.2 * np.random.default_rng(2).normal(size=(100, 3))

ABOUT_GRAVITY = {
    "quarter turn": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    "half turn": [[-1, 0, 0], [0, -1, 0], [0, 0, 1]],
    "mirror": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "exchange of x and y": [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
}


def run(folder, model, positions, velocities, **changes):
    settings = {"particles": 100, "volume_fraction": 1e-3, "step": 0.1, "duration": 1.0}
    settle(
        model, Properties(), save_interval=0.5, seed=1, precision="float64", positions=positions,
        velocities=velocities, trajectory=folder / "case.nc", series=folder / "case.series.nc",
        **settings | changes,
    )  # fmt: skip
    return xr.load_dataset(folder / "case.nc").coordinates.values


# Models that have all symmetries of Stokes flow; the paper's network has not.
@pytest.mark.parametrize("model", [RotnePrager(), load_model()], ids=lambda model: model.name)
@pytest.mark.parametrize("symmetry", ABOUT_GRAVITY)
def test_motion_keeps_the_symmetries_of_the_cube_about_gravity(tmp_path, model, symmetry):
    turn = np.array(ABOUT_GRAVITY[symmetry], dtype=float)
    here = run(tmp_path, model, POSITIONS, VELOCITIES)
    there = run(tmp_path, model, POSITIONS @ turn.T, VELOCITIES @ turn.T)
    np.testing.assert_allclose(there, here @ turn.T, atol=1e-7)


def test_motion_is_the_same_from_any_origin_and_image(tmp_path):
    here = run(tmp_path, RotnePrager(), POSITIONS, VELOCITIES)
    rng = np.random.default_rng(3)
    shift = [2.3, -71.1, 40.2] + SIDE * rng.integers(-2, 3, size=(100, 3))
    there = run(tmp_path, RotnePrager(), POSITIONS + shift, VELOCITIES)
    np.testing.assert_allclose(there - shift, here, atol=1e-9)


def test_the_number_of_a_particle_does_not_matter(tmp_path):
    order = np.random.default_rng(4).permutation(100)
    here = run(tmp_path, RotnePrager(), POSITIONS, VELOCITIES)
    there = run(tmp_path, RotnePrager(), POSITIONS[order], VELOCITIES[order])
    np.testing.assert_array_equal(there, here[:, order])


def test_eight_copies_of_a_cube_move_as_one(tmp_path):
    # The motion hangs on n through the random start alone: the periodic cloud is the same.
    copies = SIDE * np.stack(np.meshgrid(*3 * [[0, 1]]), -1).reshape(-1, 1, 3)
    here = run(tmp_path, RotnePrager(), POSITIONS, VELOCITIES)
    there = run(
        tmp_path, RotnePrager(), (POSITIONS + copies).reshape(-1, 3), np.tile(VELOCITIES, (8, 1)),
        particles=800,
    )  # fmt: skip
    expected = (here[:, None] + copies).reshape(len(here), -1, 3)
    np.testing.assert_allclose(there, expected, atol=1e-8)
