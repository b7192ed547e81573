"""What the sketches draw: a scene in its flow, the layers of a network, a particle's own frame."""

import numpy as np
import pandas as pd

from dustfall.forces.features import KINDS, block_inputs
from dustfall.forces.frames import rotation_to_streamwise
from dustfall.forces.learned import block_widths
from dustfall.scenes import random_scenes, volume_fraction
from dustfall.units import COMPONENTS

SEED, SCENES, FARTHEST = 1, 200, 4.5
"""The scene is one of these, with its fifth neighbour so near [d_p] that spheres can be seen."""

RELATIVE_VELOCITY = np.array([0.35, 0.9, 1.0])
"""Flow past a particle that falls and drifts: upwards, and along no axis."""

PLACE, NEIGHBOUR = np.array([[0.0, 4.6, -0.8], [0.2, 4.2, 3.0]])
"""Where that particle and its neighbour are in the global frame [d_p]."""


def on_page(points) -> np.ndarray:
    """Cabinet projection (..., 2): y to the right, z upwards, x to the reader at lower left."""
    x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
    return np.stack([y - 0.42 * x, z - 0.28 * x], axis=-1)


def sketches_table(kind: str, layers: dict[str, str], neighbours: int) -> pd.DataFrame:
    """What `figures.sketches` draws, one row a sphere, arrow, layer or input.

    kind: of a learned model with two blocks; layers: for each component, as
    "40-40/30-30-30"; neighbours: how many it is given. Columns panel ("domain",
    "network", "frames"), kind, name; x, y, z [d_p], for an arrow its tip, and from_x, from_y,
    from_z, where it starts; block, layer, component and width for layers, and first and neighbours
    for what a block is given each time. Axes are rows of kind "axis", those of the particle's frame
    of kind "own axis": the rows of `rotation_to_streamwise`.
    """
    return pd.DataFrame([*_domain(), *_network(kind, layers, neighbours), *_frames()])


def _row(panel, kind, name, tip, start=(np.nan, np.nan, np.nan)) -> dict:
    names = ("x", "y", "z", "from_x", "from_y", "from_z")
    return {"panel": panel, "kind": kind, "name": name} | dict(
        zip(names, (*tip, *start), strict=True)
    )


def _scene() -> np.ndarray:
    """Neighbours (5, 3) [d_p] of the scene whose spheres hide one another least on the page."""
    phi = float(volume_fraction(FARTHEST))
    scenes, _ = random_scenes(SEED, "uniform", range(SCENES), (phi, phi))
    apart = []
    for scene in scenes:
        page = on_page(np.concatenate([np.zeros((1, 3)), scene]))
        distance = np.linalg.norm(page[:, None] - page, axis=2)
        apart.append(distance[np.triu_indices(len(page), 1)].min())
    return scenes[int(np.argmax(apart))]


def _domain():
    scene = _scene()
    yield _row("domain", "reference", "", (0.0, 0.0, 0.0))
    for number, centre in enumerate(scene, 1):
        yield _row("domain", "neighbour", f"$r_{number}$", centre)
    corner = np.array([0.0, on_page(scene)[:, 0].min() - 1.0, on_page(scene)[:, 1].min() - 1.0])
    names = ("$x$ spanwise", "$y$ streamwise", "$z$ vertical")
    for name, axis in zip(names, np.eye(3), strict=True):
        yield _row("domain", "axis", name, corner + 1.5 * axis, corner)
    for height in (3.0, 4.2, 5.4):
        start = corner + np.array([0.0, -1.6, height])
        yield _row("domain", "flow", r"$\mathbf{u}$", start + np.array([0.0, 1.3, 0.0]), start)


def _network(kind, layers, neighbours):
    for block, first, number in block_inputs(KINDS[kind].blocks, neighbours).tolist():
        yield {
            "panel": "network", "kind": "input", "name": "", "block": block, "first": first,
            "neighbours": number,
        }  # fmt: skip
    for component in COMPONENTS:
        for block, widths in enumerate(
            block_widths(kind, layers[component], component, neighbours)
        ):
            for layer, width in enumerate(widths):
                yield {
                    "panel": "network", "kind": "layer", "name": "", "block": block,
                    "layer": layer, "component": component, "width": width,
                }  # fmt: skip


def _frames():
    own = rotation_to_streamwise(RELATIVE_VELOCITY)
    origin = np.zeros(3)
    yield _row("frames", "reference", "$i$", PLACE)
    yield _row("frames", "neighbour", "$j$", NEIGHBOUR)
    for number, axis in enumerate(np.eye(3), 1):
        yield _row("frames", "axis", rf"$\mathbf{{e}}_{number}$", 1.5 * axis, origin)
    for number, axis in enumerate(own, 1):
        yield _row("frames", "own axis", rf"$\mathbf{{e}}'_{number}$", PLACE + 1.6 * axis, PLACE)
    yield _row("frames", "flow", r"$\mathbf{u}_\mathrm{rel}$", PLACE + 3.2 * own[1], PLACE)
    yield _row("frames", "position", r"$\mathbf{r}_i$", PLACE, origin)
    yield _row("frames", "position", r"$\mathbf{r}_{i,j}$", NEIGHBOUR, origin)
    yield _row("frames", "position", r"$\mathbf{r}'_{i,j}$", NEIGHBOUR, PLACE)
