import os
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from scipy.spatial import cKDTree

from dustfall.forces.formulas.isolated import MODEL as ISOLATED
from dustfall.forces.formulas.rotne_prager import MODEL as ROTNE_PRAGER
from dustfall.sedimentation import (
    AllParticles,
    BackFlow,
    Checkpoint,
    MovingNeighbours,
    NearestNeighbours,
    Output,
    Properties,
    Schedule,
    box_length,
    move,
    random_positions,
    random_start,
    settle,
    start_from,
)
from dustfall.sedimentation.neighbour_list import REORDERED_EVERY
from tests.sedimentation.runs import DUST, run


class ConstantDrag:
    name = "constant"

    def __init__(self, beta):
        self.beta = beta

    def predict(self, neighbours):
        return np.tile([0, 24 * self.beta, 0], (len(neighbours), 1))


def six_in_a_cloud():
    """Six particles that stay each other's neighbours, far from their images."""
    rng = np.random.default_rng(11)
    return (
        50
        + 4 * np.eye(6, 3)
        + 3 * np.repeat([[0, 0, 0], [1, 1, 1]], 3, axis=0)
        + rng.random((6, 3))
    )


# Truths of the motion


def test_isolated_sphere_falls_as_the_exact_solution(tmp_path):
    _, series = run(tmp_path, ISOLATED, volume_fraction=1e-6, step=0.25, duration=5.0)
    t = series.time.values
    velocity = series.tracked_velocity.values
    fallen = (series.tracked_position - series.tracked_position[0]).values
    np.testing.assert_allclose(
        velocity[:, :, 2], -(1 - np.exp(-t))[:, None].repeat(3, 1), atol=1e-12
    )
    expected = -DUST.stokes_number * (t - 1 + np.exp(-t))
    np.testing.assert_allclose(fallen[:, :, 2], expected[:, None].repeat(3, 1), atol=1e-12)
    np.testing.assert_array_equal(velocity[:, :, :2], 0)
    np.testing.assert_allclose(series.settling_velocity_mean, 1 - np.exp(-t), atol=1e-12)
    np.testing.assert_allclose(series.settling_velocity_variance, 0, atol=1e-25)


@pytest.mark.parametrize("beta", [0.5, 0.7, 1.8])
def test_any_constant_drag_coefficient_is_exact_at_any_step(tmp_path, beta):
    _, series = run(tmp_path, ConstantDrag(beta), step=1.0, duration=4.0, save_interval=4.0)
    t = series.time.values
    np.testing.assert_allclose(
        series.settling_velocity_mean, (1 - np.exp(-beta * t)) / beta, rtol=1e-12
    )
    np.testing.assert_allclose(series.inverse_beta_mean, 1 / beta, rtol=1e-14)


def test_stokes_start_of_isolated_spheres_is_their_steady_state(tmp_path):
    _, series = run(tmp_path, ISOLATED, start="stokes")
    np.testing.assert_array_equal(series.settling_velocity_mean, 1)
    np.testing.assert_allclose(series.tracked_force, np.tile([0, 0, 1], (21, 3, 1)), atol=1e-15)


def test_time_stepping_is_of_second_order(tmp_path):
    def end(step):
        _, series = run(
            tmp_path, volume_fraction=1e-6, positions=six_in_a_cloud(), step=step,
            save_interval=2.0,
        )  # fmt: skip
        return np.stack([series.tracked_position[-1], 10 * series.tracked_velocity[-1]])

    exact = end(2 / 1024)
    error = [np.abs(end(step) - exact).max() for step in (0.2, 0.1, 0.05, 0.025)]
    order = np.log2(np.divide(error[:-1], error[1:]))
    assert (order > 1.8).all(), (error, order)


def test_change_of_momentum_is_the_sum_of_weight_and_drag(tmp_path):
    _, series = run(
        tmp_path, volume_fraction=1e-6, positions=six_in_a_cloud(), step=0.01,
        save_interval=2.0,
    )  # fmt: skip
    force = series.tracked_force.values - [0, 0, 1]
    impulse = 0.01 * (force[1:] + force[:-1]).sum(axis=0) / 2
    change = (series.tracked_velocity[-1] - series.tracked_velocity[0]).values
    np.testing.assert_allclose(impulse, change, atol=2e-5)


def test_steady_drag_carries_weight_less_buoyancy(tmp_path):
    trajectory, _ = run(tmp_path, particles=300, duration=12.0, save_interval=1.0)
    late = trajectory.isel(frame=slice(8, None))
    acceleration = late.velocities.mean("atom").diff("frame")[:, 2]
    assert np.abs(acceleration).max() < 0.02
    drag = (late.drag_coefficient * -late.velocities[:, :, 2]).mean()
    assert float(drag) == pytest.approx(1, abs=0.05)


def test_motion_is_the_same_wherever_the_box_is_cut(tmp_path):
    side = box_length(100, 1e-3)
    positions = random_positions(np.random.default_rng(1), 100, 1e-3)
    shift = np.array([12.3, -40.1, 7.7])
    here, _ = run(tmp_path, positions=positions)
    there, _ = run(tmp_path, positions=(positions + shift) % side)
    np.testing.assert_allclose(there.velocities, here.velocities, atol=1e-6)
    travelled = here.coordinates - here.coordinates[0]
    travelled_there = there.coordinates - there.coordinates[0]
    np.testing.assert_allclose(travelled_there, travelled, atol=1e-9)


def test_motion_turns_with_the_cloud_about_gravity(tmp_path):
    positions = random_positions(np.random.default_rng(1), 100, 1e-3)
    quarter_turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    here, _ = run(tmp_path, positions=positions)
    there, _ = run(tmp_path, positions=positions @ quarter_turn.T)
    np.testing.assert_allclose(
        there.coordinates, here.coordinates.values @ quarter_turn.T, atol=1e-8
    )


@pytest.mark.parametrize(
    ("volume_fraction", "inverse_beta"),
    [(1e-3, 1.458), (1e-4, 1.204), (1e-5, 1.094), (1e-6, 1.043), (1e-7, 1.020), (1e-8, 1.009)],
)
def test_random_cloud_starts_at_the_known_mean_inverse_beta(
    tmp_path, volume_fraction, inverse_beta
):
    # Means over 3000 random environments with the inverse of the Rotne-Prager mobility.
    _, series = run(
        tmp_path, particles=3000, volume_fraction=volume_fraction, duration=0.1, save_interval=0.1
    )
    assert float(series.inverse_beta_mean[0]) == pytest.approx(inverse_beta, abs=0.01)


# Truths of the files


def test_series_agrees_with_the_trajectory(tmp_path):
    trajectory, series = run(
        tmp_path, volume_fraction=0.1, step=0.1, duration=1.0, save_interval=0.1
    )
    side = series.attrs["cell_length"]
    falling = -trajectory.velocities[:, :, 2]
    np.testing.assert_allclose(series.time, trajectory.time, rtol=1e-14)
    np.testing.assert_allclose(series.settling_velocity_mean, falling.mean("atom"), atol=1e-6)
    np.testing.assert_allclose(series.settling_velocity_variance, falling.var("atom"), atol=1e-6)
    beta = trajectory.drag_coefficient
    np.testing.assert_allclose(series.beta_mean, beta.mean("atom"), rtol=1e-5)
    np.testing.assert_allclose(series.inverse_beta_mean, (1 / beta).mean("atom"), rtol=1e-5)
    tracked = series.tracked.values
    np.testing.assert_array_equal(series.tracked_position, trajectory.coordinates[:, tracked])
    np.testing.assert_allclose(
        series.tracked_velocity, trajectory.velocities[:, tracked], 1e-6, 1e-7
    )

    fives, overlaps = [], []
    for frame in trajectory.coordinates.values:
        tree = cKDTree(frame % side, boxsize=side)
        fives.append(np.sort(tree.query(frame % side, k=6)[1][:, 1:], axis=1))
        overlaps.append(len(tree.query_pairs(1.0)))
    fresh = [0.0, *((a != b).any(axis=1).mean() for a, b in pairwise(fives))]
    np.testing.assert_allclose(series.new_neighbours, fresh)
    np.testing.assert_array_equal(series.overlaps, overlaps)
    assert max(fresh) > 0
    assert max(overlaps) > 0


def test_trajectory_follows_the_amber_convention(tmp_path):
    run(tmp_path, precision="float32")
    with netCDF4.Dataset(tmp_path / "case.nc") as file:
        assert file.Conventions == "AMBER"
        assert file.ConventionVersion == "1.0"
        assert file.program
        assert file.programVersion
        assert file.dimensions["frame"].isunlimited()
        assert {name: len(file.dimensions[name]) for name in ("spatial", "atom", "label")} == {
            "spatial": 3, "atom": 100, "label": 5,
        }  # fmt: skip
        file.set_auto_chartostring(False)
        assert b"".join(file["spatial"][:].filled()) == b"xyz"
        assert b"".join(file["cell_spatial"][:].filled()) == b"abc"
        assert [b"".join(row) for row in file["cell_angular"][:].filled()] == [
            b"alpha", b"beta ", b"gamma",
        ]  # fmt: skip
        assert file["coordinates"].dimensions == ("frame", "atom", "spatial")
        assert file["coordinates"].dtype == np.float32
        assert file["velocities"].dimensions == ("frame", "atom", "spatial")
        assert file["drag_coefficient"].dimensions == ("frame", "atom")
        np.testing.assert_allclose(file["time"][:], [0, 0.5, 1, 1.5, 2])
        np.testing.assert_allclose(file["cell_lengths"][:], box_length(100, 1e-3))
        np.testing.assert_array_equal(file["cell_angles"][:], 90)
        assert file["cell_angles"].units == "degree"
        for name in ("time", "coordinates", "velocities", "cell_lengths", "drag_coefficient"):
            assert file[name].units


def test_files_name_their_units_settings_and_model(tmp_path):
    for dataset in run(tmp_path):
        assert dataset.attrs["n"] == 100
        assert dataset.attrs["volume_fraction"] == 1e-3
        assert dataset.attrs["galileo"] == DUST.galileo
        assert dataset.attrs["stokes_number"] == DUST.stokes_number
        assert dataset.attrs["seed"] == 1
        assert dataset.attrs["model"] == "rotne_prager"
        assert dataset.attrs["viscosity"] == DUST.viscosity
        assert dataset.attrs["cell_length"] == box_length(100, 1e-3)
    _, series = run(tmp_path)
    assert all(series[name].attrs["units"] for name in series.data_vars)
    assert series.tracked_force.dims == ("step", "tracked", "spatial")
    assert series.sizes == {"step": 21, "tracked": 3, "spatial": 3}


def test_models_that_differ_have_different_digests(tmp_path):
    first, _ = run(tmp_path, ConstantDrag(0.7))
    second, _ = run(tmp_path, ConstantDrag(0.8))
    assert first.attrs["model_digest"] != second.attrs["model_digest"]


def test_same_seed_gives_the_same_bits_and_another_seed_does_not(tmp_path):
    first, again, other = (run(tmp_path, seed=seed)[0] for seed in (5, 5, 6))
    assert first.identical(again)
    assert not np.array_equal(first.coordinates, other.coordinates)


# Runs that are interrupted

KILLED_RUN = """
import os, signal, sys
from tests.sedimentation.runs import run

def kill(done, total):
    if done == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)

run(sys.argv[1], checkpoint=sys.argv[1] + "/checkpoint", checkpoint_interval=0.0, progress=kill)
"""


def assert_same_files(folder, other):
    for name in ("case.nc", "case.series.nc"):
        assert xr.load_dataset(folder / name).identical(xr.load_dataset(other / name))
    assert sorted(path.name for path in folder.iterdir()) == ["case.nc", "case.series.nc"]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    run(folder)
    return folder


def test_killed_run_goes_on_to_the_same_bits(tmp_path, undisturbed):
    for step in (6, 15):
        killed = subprocess.run(
            [sys.executable, "-c", KILLED_RUN, str(tmp_path), str(step)], check=False
        )
        assert killed.returncode == -signal.SIGKILL
        assert not (tmp_path / "case.nc").exists()
    steps = []
    run(
        tmp_path,
        checkpoint=tmp_path / "checkpoint",
        progress=lambda done, total: steps.append(done),
    )
    assert steps == list(range(15, 21))
    assert_same_files(tmp_path, undisturbed)


def test_run_killed_at_ten_random_moments_ends_with_the_same_bits(tmp_path, undisturbed):
    rng = np.random.default_rng(12)
    settings = {"checkpoint": tmp_path / "checkpoint", "checkpoint_interval": 0.0}
    killed = 0
    while killed < 10:
        process = get_context("fork").Process(target=run, args=(tmp_path,), kwargs=settings)
        process.start()
        process.join(rng.uniform(0.01, 0.1))
        if process.exitcode is None:
            process.kill()
            killed += 1
        process.join()
        assert process.exitcode in (0, -signal.SIGKILL)
        if process.exitcode == 0:  # done before the moment came: once more from the start
            assert_same_files(tmp_path, undisturbed)
            for path in tmp_path.iterdir():
                path.unlink()
    run(tmp_path, **settings)
    assert_same_files(tmp_path, undisturbed)


class Interruption(BaseException):
    """Stands for a crash at a chosen place; nothing in the library catches it."""


def crash_and_go_on(folder, monkeypatch, owner, function, crash):
    """Run into a function of `owner` that crashes, then once more with it whole."""
    with monkeypatch.context() as patch:
        patch.setattr(owner, function, crash)
        with pytest.raises(Interruption):
            run(folder, checkpoint=folder / "checkpoint", checkpoint_interval=0.0)
    run(folder, checkpoint=folder / "checkpoint")


@pytest.mark.parametrize("replacement", range(1, 6))
def test_run_that_crashes_amid_a_checkpoint_goes_on_to_the_same_bits(
    tmp_path, undisturbed, monkeypatch, replacement
):
    count = 0

    def crash(source, target, replace=os.replace):
        nonlocal count
        count += 1
        if count == replacement:
            raise Interruption
        replace(source, target)

    crash_and_go_on(tmp_path, monkeypatch, os, "replace", crash)
    assert_same_files(tmp_path, undisturbed)


@pytest.mark.parametrize("last", ["state.bin", "state.previous.bin", "frames.bin", "series.bin"])
def test_run_that_crashes_amid_its_clearing_up_goes_on_to_the_same_bits(
    tmp_path, undisturbed, monkeypatch, last
):
    def crash(path, *arguments, unlink=Path.unlink, **settings):
        unlink(path, *arguments, **settings)
        if path.name == last:
            raise Interruption

    crash_and_go_on(tmp_path, monkeypatch, Path, "unlink", crash)
    assert_same_files(tmp_path, undisturbed)


def interrupt_at(step):
    def interrupt(done, total):
        if done == step:
            raise Interruption

    return interrupt


class MindfulOfOrder:
    """A model whose forces depend on the place of a scene among those that it is shown."""

    def predict(self, neighbours):
        force = ROTNE_PRAGER.predict(neighbours)
        force[:, 1] *= 1 + 1e-6 * np.arange(len(force))
        return force


def test_interrupted_run_goes_on_to_the_same_bits_with_a_model_that_minds_the_order(tmp_path):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    settings = {"model": MindfulOfOrder(), "duration": 0.1 * (REORDERED_EVERY + 9)}
    run(whole, **settings, save_interval=0.1)
    for step in (7, REORDERED_EVERY, REORDERED_EVERY + 4):
        with pytest.raises(Interruption):
            run(
                parts, **settings, save_interval=0.1, checkpoint=parts / "checkpoint",
                checkpoint_interval=0.0, progress=interrupt_at(step),
            )  # fmt: skip
    run(parts, **settings, save_interval=0.1, checkpoint=parts / "checkpoint")
    assert_same_files(parts, whole)


@pytest.mark.parametrize(
    "closure",
    [
        lambda number: NearestNeighbours(ISOLATED),
        lambda number: AllParticles(
            DUST, number(0.125), shortest_memory=number(0.5), tolerance=number(2.0**-10)
        ),
        lambda number: MovingNeighbours(DUST, number(0.125)),
        lambda number: BackFlow(ISOLATED, number(2.0**-10)),
    ],
)
def test_numbers_of_numpy_are_saved_and_read_as_plain_ones(tmp_path, closure):
    """In single precision, of which each is a number."""
    ends = []
    for number in (float, np.float32):
        folder, checkpoint = tmp_path / number.__name__, Checkpoint(tmp_path / "checkpoint", 0.0)
        output = Output(folder / "case.nc", folder / "case.series.nc")
        start = random_start(60, number(2.0**-10), seed=1)
        schedule = Schedule(number(0.125), number(1.0), number(0.5))
        arguments = closure(number), start, DUST, schedule, output, checkpoint
        with pytest.raises(Interruption):
            settle(*arguments, progress=interrupt_at(5))
        settle(*arguments)
        ends.append(xr.load_dataset(output.series))
    assert ends[0].identical(ends[1])


# Half of the records is less than either state stands on: such a run begins anew.
@pytest.mark.parametrize(
    ("damaged", "resumed"), [("state.bin", 10), ("frames.bin", 0), ("series.bin", 0)]
)
def test_run_with_a_damaged_checkpoint_goes_on_to_the_same_bits(
    tmp_path, undisturbed, damaged, resumed
):
    checkpoint = tmp_path / "checkpoint"
    with pytest.raises(Interruption):
        run(tmp_path, checkpoint=checkpoint, checkpoint_interval=0.0, progress=interrupt_at(11))
    with open(checkpoint / damaged, "r+b") as file:
        file.truncate(file.seek(0, os.SEEK_END) // 2)
    steps = []
    run(tmp_path, checkpoint=checkpoint, progress=lambda done, total: steps.append(done))
    assert steps[0] == resumed
    assert_same_files(tmp_path, undisturbed)


@pytest.mark.parametrize("file", ["state.bin", "frames.bin", "series.bin"])
def test_no_flipped_bit_of_a_checkpoint_gets_into_the_results(tmp_path, undisturbed, file):
    checkpoint = tmp_path / "checkpoint"
    rng = np.random.default_rng(5)
    for _ in range(4):
        with pytest.raises(Interruption):
            run(tmp_path, checkpoint=checkpoint, checkpoint_interval=0.0, progress=interrupt_at(11))
        damaged = bytearray((checkpoint / file).read_bytes())
        damaged[rng.integers(len(damaged))] ^= 1 << rng.integers(8)
        (checkpoint / file).write_bytes(damaged)
        run(tmp_path, checkpoint=checkpoint)
        assert_same_files(tmp_path, undisturbed)


@pytest.mark.parametrize("content", [b"", b"text\n", b"PK\x03\x04", b"\x93NUMPY\x01\x00"])
def test_a_checkpoint_of_another_kind_heals_like_a_damaged_one(tmp_path, undisturbed, content):
    checkpoint = tmp_path / "checkpoint"
    checkpoint.mkdir()
    for name in ("state.bin", "state.previous.bin"):
        (checkpoint / name).write_bytes(content)
    run(tmp_path, checkpoint=checkpoint)
    assert_same_files(tmp_path, undisturbed)


def test_two_runs_at_once_are_refused(tmp_path, undisturbed):
    checkpoint = tmp_path / "checkpoint"

    def begin_another(done, total):
        if done == 7:
            with pytest.raises(ValueError, match=r"another run is at work in .*checkpoint"):
                run(tmp_path, checkpoint=checkpoint)

    run(tmp_path, checkpoint=checkpoint, checkpoint_interval=0.0, progress=begin_another)
    assert_same_files(tmp_path, undisturbed)


def test_records_damaged_while_a_run_goes_on_are_told_and_healed(tmp_path, undisturbed):
    checkpoint = tmp_path / "checkpoint"

    def damage(done, total):
        if done == total:
            with open(checkpoint / "frames.bin", "r+b") as file:
                file.seek(100)
                file.write(b"damage")

    with pytest.raises(ValueError, match=r"frames\.bin was damaged while the run went on"):
        run(tmp_path, checkpoint=checkpoint, checkpoint_interval=0.0, progress=damage)
    assert not (tmp_path / "case.nc").exists()
    run(tmp_path, checkpoint=checkpoint)
    assert_same_files(tmp_path, undisturbed)


@pytest.mark.parametrize("lost", ["frames.bin", "series.bin"])
def test_run_whose_records_are_lost_begins_anew(tmp_path, undisturbed, lost):
    checkpoint = tmp_path / "checkpoint"
    with pytest.raises(Interruption):
        run(tmp_path, checkpoint=checkpoint, checkpoint_interval=0.0, progress=interrupt_at(11))
    (checkpoint / lost).unlink()
    run(tmp_path, checkpoint=checkpoint)
    assert_same_files(tmp_path, undisturbed)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_terminated_run_saves_its_state_and_goes_on_to_the_same_bits(tmp_path, undisturbed, number):
    checkpoint, before = tmp_path / "checkpoint", signal.getsignal(number)

    def terminate(done, total):
        if done == 8:
            os.kill(os.getpid(), number)

    with pytest.raises(SystemExit, match="after step 9 of 20"):
        run(tmp_path, checkpoint=checkpoint, progress=terminate)
    assert signal.getsignal(number) == before
    steps = []
    run(tmp_path, checkpoint=checkpoint, progress=lambda done, total: steps.append(done))
    assert steps[0] == 9
    assert_same_files(tmp_path, undisturbed)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"step": 0.05}, "step is 0.05, there 0.1"),
        ({"seed": 2}, "start_digest is"),
        ({"model": ConstantDrag(0.7)}, "model is 'constant', there 'rotne_prager'"),
        ({"properties": Properties(viscosity=1e-5)}, "viscosity"),
    ],
)
def test_checkpoint_of_other_settings_is_refused_by_name(tmp_path, change, named):
    checkpoint = tmp_path / "checkpoint"
    with pytest.raises(Interruption):
        run(tmp_path, checkpoint=checkpoint, checkpoint_interval=0.0, progress=interrupt_at(3))
    with pytest.raises(ValueError, match=named):
        run(tmp_path, **{"checkpoint": checkpoint} | change)


def test_a_state_that_has_moved_already_starts_as_its_places_and_velocities_do(tmp_path):
    closure, schedule = NearestNeighbours(ROTNE_PRAGER), Schedule(0.1, 1.0, 0.5)
    moved = random_start(60, 1e-3, seed=3)
    for _ in range(15):
        moved = move(moved, closure(moved), 0.1, DUST.stokes_number)

    def stop(done, total):
        assert done <= total

    for name, start in (
        ("moved", moved),
        ("anew", start_from(moved.position, 1e-3, moved.velocity)),
    ):
        output = Output(tmp_path / f"{name}.nc", tmp_path / f"{name}.series.nc")
        settle(closure, start, DUST, schedule, output, progress=stop)
    for file in ("{}.nc", "{}.series.nc"):
        here, there = (xr.load_dataset(tmp_path / file.format(name)) for name in ("moved", "anew"))
        assert here.identical(there)


HEAVIER = DUST.with_galileo_multiple(4)

# Twice the fluid's density, the same settling velocity and response time.
DENSER = replace(
    DUST,
    fluid_density=2 * DUST.fluid_density,
    gravity=DUST.gravity
    * (DUST.particle_density - DUST.fluid_density)
    / (DUST.particle_density - 2 * DUST.fluid_density),
)


@pytest.mark.parametrize(
    ("closure", "change", "told"),
    [
        (lambda: AllParticles(DUST, 0.1), {"properties": HEAVIER}, "all_particles .* Stokes"),
        (lambda: AllParticles(DUST, 0.1), {"properties": DENSER}, "all_particles .* viscosity"),
        (lambda: MovingNeighbours(DUST, 0.1), {"properties": HEAVIER}, "moving_.* Stokes number"),
        (lambda: BackFlow(ISOLATED, 1e-3), {"volume_fraction": 1e-5}, "back_flow .* fraction phi"),
    ],
)
def test_a_run_refuses_a_closure_that_is_made_for_another(tmp_path, closure, change, told):
    with pytest.raises(ValueError, match=told):
        run(tmp_path, closure=closure(), **change)


def test_a_failed_run_leaves_nothing_behind(tmp_path):
    with pytest.raises(Interruption):
        run(tmp_path, progress=interrupt_at(3))
    assert list(tmp_path.iterdir()) == []


def test_foreign_files_in_the_checkpoint_folder_stay(tmp_path):
    checkpoint = tmp_path / "checkpoint"
    checkpoint.mkdir()
    (checkpoint / "notes.txt").write_text("mine")
    run(tmp_path, checkpoint=checkpoint)
    assert [path.name for path in checkpoint.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"step": 0.0}, "step is 0.0"),
        ({"duration": 0.55, "save_interval": 0.1}, "duration is 0.55"),
        ({"save_interval": 0.25}, "save_interval is 0.25"),
        ({"save_interval": 0.3}, r"multiple of save_interval, 0\.3, .* to it are 1\.8 and 2\.1$"),
        ({"duration": 0.2}, r"duration is 0\.2: .* save_interval, 0\.5, .* to it is 0\.5$"),
        ({"duration": 1e300}, r"duration is 1e\+300"),
        ({"properties": Properties(diameter=25.0)}, "the Galileo number is 7.*e\\+16"),
        ({"start": "flying"}, "start is 'flying'"),
        ({"precision": "float16"}, "precision is 'float16'"),
        ({"particles": 5}, "5 particles: at least 6"),
        ({"volume_fraction": 0.6}, "phi is 0.6"),
        ({"positions": np.zeros((7, 2))}, r"\(7, 2\)"),
        ({"positions": np.eye(7, 3), "velocities": np.zeros((6, 3))}, r"\(6, 3\)"),
    ],
)
def test_settings_out_of_range_are_refused_by_name(tmp_path, change, named):
    with pytest.raises(ValueError, match=named):
        run(tmp_path, **change)
