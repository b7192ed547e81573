"""Cases of the plugin: made, changed, run on one rank or two, and read back."""

import re
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from dustfall.forces import load_model
from dustfall.sedimentation import Properties, start_from
from dustfall.sedimentation.closures.nearest_neighbours import drag_coefficients
from openfoam.cases.make_settling import PLUGIN, make_case
from openfoam.cases.read_settling import read_frames

SOLVER = "icoUncoupledKinematicParcelFoam"

PROPERTIES = Properties()
STEP = 0.1  # tau


def pytest_collection_modifyitems(items):
    """Mark all tests of this folder; skip them, with the reason, where they cannot run."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.openfoam)
            if shutil.which(SOLVER) is None or not PLUGIN.exists():
                item.add_marker(pytest.mark.skip("no plugin here: openfoam/build.sh makes it"))


class Case:
    """A case in a folder, with parcels in the order of the numbers that they had at the start."""

    def __init__(self, folder, start, steps=3, model=None, **settings):
        self.folder, self.start = folder, start
        make_case(folder, start, STEP, steps * STEP, model=model, properties=PROPERTIES, **settings)

    def change(self, file, *replacements):
        """Replace text in a file of the case; each (old, new) has to occur."""
        path = self.folder / file
        text = path.read_text()
        for old, new in replacements:
            assert old in text, f"{file} has no {old}"
            text = text.replace(old, new)
        path.write_text(text)

    def open_axes(self, closed):
        """Put walls across the axes that are not periodic (1, 1, 0: walls above and below)."""
        pairs = ("west", "east"), ("south", "north"), ("below", "above")
        for names, periodic in zip(pairs, closed, strict=True):
            for own, other in (names, names[::-1]):
                if not periodic:
                    block = (self.folder / "system/blockMeshDict").read_text()
                    (old,) = re.findall(rf"{own} +{{ type cyclic; neighbourPatch {other};", block)
                    self.change("system/blockMeshDict", (old, f"{own} {{ type wall;"))
                    wall = f"    {own} {{ type noSlip; }}\n}}\n"
                    text = (self.folder / "0/U").read_text().rstrip().removesuffix("}")
                    (self.folder / "0/U").write_text(text + wall)
        self.change(
            "constant/kinematicCloudProperties",
            (
                "patchInteractionModel   none;",
                "patchInteractionModel   rebound;\n    reboundCoeffs { UFactor 1; }",
            ),
        )

    def run(self, ranks=1):
        """Mesh and settle; returns the solver's output. RuntimeError with it where it fails."""
        command = [self.folder / "Allrun", str(ranks)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stdout + done.stderr)
        return done.stdout

    def refusal(self):
        """Return the solver's message, on one line, where it has to refuse the case."""
        with pytest.raises(RuntimeError, match="FOAM FATAL") as error:
            self.run()
        return " ".join(str(error.value).split())

    def frames(self):
        """Return positions (n, 3) [d_p], velocities (n, 3) [v_s] and ranks (n,), a list of each.

        The first frame is the start, all on rank 0.
        """
        side, start = self.start.box_length, self.start.position
        wrapped = start - side * np.floor(start / side)
        frames = [(wrapped, self.start.velocity, np.zeros(len(wrapped)))]
        frames += [frame[1:] for frame in read_frames(self.folder, PROPERTIES)]
        return tuple(zip(*frames, strict=True))


@pytest.fixture(name="make_case")
def _make_case(tmp_path):
    """A function that makes a case in a folder of this test."""

    def make(start, name="case", **settings):
        return Case(tmp_path / name, start, **settings)

    return make


def random_cloud(particles=216, phi=1e-2, seed=0, spread=0.5):
    """A cloud whose particles fall in all directions; one is at rest, two move along the axes."""
    from dustfall.sedimentation import random_start

    rng = np.random.default_rng(seed)
    velocity = [0.0, 0.0, -1.0] + spread * rng.normal(size=(particles, 3))
    velocity[:3] = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]
    return start_from(random_start(particles, phi, seed).position, phi, velocity)


def neighbours_of(positions, others, side, axes=(1, 1, 1), number=5):
    """Vectors (n, number, 3) to the nearest others, by comparing all pairs."""
    separation = others[None] - positions[:, None]
    for axis in np.flatnonzero(axes):
        separation[..., axis] -= side * np.rint(separation[..., axis] / side)
    distance = np.linalg.norm(separation, axis=2)
    distance[distance < 1e-9] = np.inf
    rows = np.argsort(distance, axis=1)[:, :number]
    return np.take_along_axis(separation, rows[:, :, None], axis=1)


def next_velocity(velocity, neighbours, model=None, step=STEP):
    """Velocity [v_s] after a step [tau] in which the drag law of its start holds."""
    beta, force = drag_coefficients(model or load_model(), velocity, neighbours)
    weight = [0.0, 0.0, -1.0]
    decay = np.exp(-beta * step)[:, None]
    return velocity * decay + (1 - decay) / beta[:, None] * (force + weight)


def largest_error(frames, start, axes=(1, 1, 1), model=None):
    """Largest difference [v_s] of any velocity from what the frame before leads to."""
    positions, velocities, _ = frames
    number = getattr(model, "neighbours", 5)
    errors = [
        np.abs(
            next_velocity(v, neighbours_of(x, x, start.box_length, axes, number), model) - following
        ).max()
        for x, (v, following) in zip(positions, pairwise(velocities), strict=False)
    ]
    assert len(errors) == len(positions) - 1 > 0
    return max(errors)
