"""Mesh the sphere with gmsh at one edge length."""

import h5py

import joblog
from dustfall.files import atomic
from dustfall.stokes.elements.mesh import sphere_mesh

joblog.start(snakemake.log[0])

size = float(snakemake.wildcards.size)
mesh = sphere_mesh(size)
with atomic(snakemake.output[0]) as path, h5py.File(path, "w") as file:
    file.attrs["edge_length"] = size
    file.attrs["unit"] = "radii"
    file.create_dataset("vertices", data=mesh.vertices, track_times=False)
    file.create_dataset("triangles", data=mesh.triangles, track_times=False)
print(f"edges of {size} radii: {len(mesh.triangles)} elements, {len(mesh.vertices)} nodes")
