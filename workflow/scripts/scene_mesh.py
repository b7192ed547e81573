"""Solve one scene on meshes and keep them, for gmsh and for ParaView."""

import numpy as np

import joblog
from dustfall.columns import read_columns
from dustfall.scenes import SCENE_COLUMNS
from dustfall.stokes.elements.mesh_files import write_scene_mesh
from dustfall.stokes.elements.scene import fixed_spheres_on_meshes

joblog.start(snakemake)

shard = read_columns(snakemake.input.scenes, SCENE_COLUMNS)
(own,) = np.flatnonzero(shard["scene"] == snakemake.params.number)
centres = np.concatenate([np.zeros((1, 3)), shard["neighbours"][own]])
solution = fixed_spheres_on_meshes(centres, tolerance=snakemake.params.tolerance)
for path in snakemake.output:
    write_scene_mesh(path, solution)
elements = [len(sphere.template.mesh.triangles) for sphere in solution.spheres]
print(f"{solution.status}, smallest gap {solution.minimum_gap:.3g} d_p, elements {elements}")
