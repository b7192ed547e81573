"""Draw the meshes of a compact scene and of the nearest contact of the first shards."""

from pathlib import Path

import numpy as np
import pandas as pd

import joblog
from dustfall.benchmarks.audit import TOLERANCE
from dustfall.columns import read_columns
from dustfall.figures.scene import scene_meshes
from dustfall.figures.style import save
from dustfall.scenes import SCENE_COLUMNS
from dustfall.stokes.elements.mesh_files import element_table
from dustfall.stokes.elements.scene import NARROWEST_GAP, fixed_spheres_on_meshes
from dustfall.units import CONTACT

joblog.start(snakemake)

shards = [read_columns(path, SCENE_COLUMNS)["neighbours"] for path in snakemake.input.scenes]
neighbours = np.concatenate(shards)
number = neighbours.shape[1]
distance = np.linalg.norm(neighbours, axis=2)
tolerance = max(snakemake.params.tolerance, TOLERANCE)


def meshed(scene, spheres):
    """Elements of the first spheres of a scene, near enough to be seen beside each other."""
    centres = np.concatenate([np.zeros((1, 3)), neighbours[scene]])
    table = element_table(fixed_spheres_on_meshes(centres, tolerance=tolerance))
    return table[table["sphere"] < spheres]


# The farthest neighbour says phi alone; the one before it, how compact a scene is.
compact = np.argmin(distance[:, -2])
# A narrower gap is not meshed.
meshable = distance[:, 0] >= CONTACT + NARROWEST_GAP
nearest = np.argmin(np.where(meshable, distance[:, 0], np.inf))
pair = meshed(nearest, 2)
gap = f"gap {distance[nearest, 0] - CONTACT:.2g} $d_p$"
panels = [
    meshed(compact, number).assign(scene=0, title=f"{number} of {number + 1} spheres"),
    pair.assign(scene=1, title=gap),
    pair[pair["sphere"] == 0].assign(scene=2, title="seen from the neighbour"),
]
# The gap is seen from its side, across the flow, and then face to face.
axis = neighbours[nearest, 0]
eyes = [(0.0, 0.0, 0.0), np.cross(axis, (0.0, 1.0, 0.0)), axis]
panels = [
    panel.assign(view_x=eye[0], view_y=eye[1], view_z=eye[2])
    for panel, eye in zip(panels, eyes, strict=True)
]
drawn = pd.concat(panels, ignore_index=True)
save(scene_meshes(drawn), drawn, Path(snakemake.output.png).with_suffix(""))
