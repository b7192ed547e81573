"""Draw the densest scene and the nearest contact of the first shards with their meshes."""

from pathlib import Path

import numpy as np
import pandas as pd

import joblog
from dustfall.columns import read_columns
from dustfall.figures.scene import scene_meshes
from dustfall.figures.style import save
from dustfall.scenes import SCENE_COLUMNS
from dustfall.stokes.elements.mesh_files import element_table
from dustfall.stokes.elements.scene import fixed_spheres_on_meshes

joblog.start(snakemake.log[0])

shards = [read_columns(path, SCENE_COLUMNS)["neighbours"] for path in snakemake.input.scenes]
neighbours = np.concatenate(shards)
distance = np.linalg.norm(neighbours, axis=2)
densest, nearest = np.argmin(distance[:, -1]), np.argmin(distance[:, 0])
panels, tolerance = [], snakemake.params.tolerance
for scene, chosen in enumerate((densest, nearest)):
    centres = np.concatenate([np.zeros((1, 3)), neighbours[chosen]])
    table = element_table(fixed_spheres_on_meshes(centres, tolerance=tolerance))
    title = f"gap {distance[chosen, 0] - 1.0:.2g} $d_p$" if scene else "densest scene"
    panels.append(table.assign(scene=scene, title=title, view_x=0.0, view_y=0.0, view_z=0.0))
x, y, z = neighbours[nearest, 0]
close_up = {"scene": 2, "title": "seen from its neighbour", "view_x": x, "view_y": y, "view_z": z}
panels.append(table[table["sphere"] == 0].assign(**close_up))
drawn = pd.concat(panels, ignore_index=True)
save(scene_meshes(drawn), drawn, Path(snakemake.output.png).with_suffix(""))
