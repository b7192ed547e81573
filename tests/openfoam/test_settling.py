"""A cloud settles in OpenFOAM as the Python package says, on one rank and on two."""

import shutil

import numpy as np
import pytest

from dustfall.forces import FORMULAS, load_model
from dustfall.sedimentation import NearestNeighbours, random_start, step
from tests.cpp.conftest import random_model
from tests.openfoam.conftest import (
    PROPERTIES,
    STEP,
    largest_error,
    neighbours_of,
    next_velocity,
    random_cloud,
)

ROUNDING = 1e-10  # v_s


@pytest.mark.parametrize("ranks", [1, 2])
def test_every_step_changes_velocities_as_the_model_says(ranks, make_case):
    case = make_case(random_cloud())
    case.run(ranks)
    assert largest_error(case.frames(), case.start) < ROUNDING


@pytest.mark.parametrize(
    "model",
    [FORMULAS["reflections"], random_model("anchored", neighbours=8), random_model("idnn")],
    ids=["formula", "eight neighbours", "spherical coordinates"],
)
def test_any_exported_model_can_be_settled_with(model, make_case):
    case = make_case(random_cloud(), model=model, steps=1)
    case.run()
    assert largest_error(case.frames(), case.start, model=model) < ROUNDING


@pytest.mark.parametrize("axes", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)])
def test_images_are_those_of_the_cyclic_patches(axes, make_case):
    case = make_case(random_cloud(), steps=1)
    case.open_axes(axes)
    output = case.run()
    side = np.array(axes) * case.start.box_length * 25e-6
    assert "periods (" in output
    periods = output.split("periods (", 1)[1].split(")")[0].split()
    np.testing.assert_allclose([float(period) for period in periods], side, rtol=1e-12)
    positions, velocities, _ = case.frames()
    x, v = positions[0], velocities[0]
    expected = next_velocity(v, neighbours_of(x, x, case.start.box_length, axes))
    inside = ((x > 3) & (x < case.start.box_length - 3)).all(axis=1)  # no wall is hit on the way
    assert inside.sum() > 20
    np.testing.assert_allclose(velocities[1][inside], expected[inside], rtol=0, atol=ROUNDING)


def test_crossings_of_periodic_and_processor_boundaries_change_nothing(make_case):
    start = random_cloud(particles=1000, spread=1.0)
    clouds = {ranks: make_case(start, f"on{ranks}", steps=8) for ranks in (1, 2)}
    for ranks, case in clouds.items():
        case.run(ranks)
    frames = {ranks: case.frames() for ranks, case in clouds.items()}
    jumps = np.abs(np.diff(frames[2][0], axis=0)) > start.box_length / 2
    assert jumps.any(axis=2).sum() > 50
    assert (np.diff(frames[2][2][1:], axis=0) != 0).sum() > 50
    assert largest_error(frames[2], start) < ROUNDING
    np.testing.assert_allclose(frames[2][1], frames[1][1], rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_run_goes_on_from_its_last_frame(ranks, make_case):
    start = random_cloud()
    whole, halves = make_case(start, "whole", steps=4), make_case(start, "halves", steps=2)
    whole.run(ranks)
    halves.run(ranks)
    duration = (whole.folder / "settings").read_text().split("duration ")[1].split(";")[0]
    half = (halves.folder / "settings").read_text().split("duration ")[1].split(";")[0]
    halves.change("settings", (f"duration {half}", f"duration {duration}"))
    halves.run(ranks)
    for got, expected in zip(halves.frames(), whole.frames(), strict=True):
        np.testing.assert_allclose(got, expected, rtol=0, atol=ROUNDING)


INJECTION = """injectionModels
    {{
        extra
        {{
            type            manualInjection;
            massTotal       0;
            parcelBasisType fixed;
            nParticle       1;
            SOI             0;
            positionsFile   "injected";
            U0              (0 0 {speed});
            sizeDistribution
            {{
                type        fixedValue;
                fixedValueDistribution {{ value 25e-6; }}
            }}
        }}
    }}"""


def inject(case, positions):
    """Add an injection of parcels at `positions` [d_p], at the Stokes velocity, in step 1."""
    lines = "\n".join(
        f"({x!r} {y!r} {z!r})" for x, y, z in (positions * PROPERTIES.diameter).tolist()
    )
    head = "FoamFile { version 2.0; format ascii; class vectorField; object injected; }\n"
    (case.folder / "constant/injected").write_text(f"{head}(\n{lines}\n)\n")
    speed = repr(-PROPERTIES.settling_velocity)
    case.change(
        "constant/kinematicCloudProperties",
        ("injectionModels\n    {}", INJECTION.format(speed=speed)),
    )


def test_parcels_injected_in_a_step_see_the_neighbours_of_its_start(make_case):
    start = random_cloud()
    case = make_case(start, steps=2)
    rng = np.random.default_rng(9)
    extra = rng.uniform(2, start.box_length - 2, (400, 3))
    # They meet no face of the mesh in their first step, at whose end the solver asks for the drag.
    cell = start.box_length / 3
    extra = extra[extra[:, 2] % cell > 2 * STEP * PROPERTIES.stokes_number]
    gap = np.linalg.norm(extra[:, None] - start.position, axis=2).min(axis=1)
    extra = extra[gap > 1.0][:20]
    inject(case, extra)
    case.run()
    positions, velocities, _ = case.frames()
    old = len(start.position)
    assert [len(frame) for frame in positions] == [old, old + 20, old + 20]

    def expected(frame, rows=slice(None)):
        x, v = positions[frame][rows], velocities[frame][rows]
        return next_velocity(v, neighbours_of(x, positions[frame], start.box_length))

    np.testing.assert_allclose(velocities[1][:old], expected(0), rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(velocities[2], expected(1), rtol=0, atol=ROUNDING)
    fall = np.tile([0.0, 0.0, -1.0], (20, 1))
    asked = extra + STEP * PROPERTIES.stokes_number * fall
    seen = neighbours_of(asked, positions[0], start.box_length)
    # This solver moves a new parcel once as it injects it, and once with all others.
    lived = next_velocity(fall, seen, step=2 * STEP)
    np.testing.assert_allclose(velocities[1][old:], lived, rtol=0, atol=ROUNDING)


def test_parcels_injected_into_nothing_feel_stokes_drag_for_a_step(make_case):
    start = random_cloud()
    case = make_case(start, steps=2)
    shutil.rmtree(case.folder / "0/lagrangian")
    shutil.rmtree(case.folder / "0/uniform")
    places = start.position[(start.position > 0.5).all(axis=1)]
    inject(case, places)
    case.run()
    positions, velocities, _ = case.frames()
    fall = np.tile([0.0, 0.0, -1.0], (len(places), 1))
    np.testing.assert_allclose(velocities[1], fall, rtol=0, atol=ROUNDING)
    seen = neighbours_of(positions[1], positions[1], start.box_length)
    np.testing.assert_allclose(
        velocities[2], next_velocity(velocities[1], seen), rtol=0, atol=ROUNDING
    )


def test_the_mean_velocity_is_that_of_the_packages_own_run(make_case):
    """The solver moves parcels by explicit Euler steps: trajectories differ, averages agree."""
    start = random_start(1000, 1e-3, seed=3, velocity="stokes")
    case = make_case(start, steps=40)
    case.run()
    _, velocities, _ = case.frames()
    state, closure = start, NearestNeighbours(load_model())
    for _ in range(40):
        state = step(state, closure, STEP, PROPERTIES.stokes_number)
    enhanced = -state.velocity[:, 2].mean()
    assert enhanced > 1.3
    np.testing.assert_allclose(-velocities[-1][:, 2].mean(), enhanced, rtol=0.01)
