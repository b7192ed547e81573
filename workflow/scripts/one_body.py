"""Assemble and factor the single-layer operator of one template."""

import h5py

import joblog
from dustfall.stokes.elements.mesh import SphereMesh
from dustfall.stokes.elements.one_body import OneBody
from dustfall.units import FORCE_UNIT

joblog.start(snakemake.log[0])

with h5py.File(snakemake.input.template) as file:
    mesh = SphereMesh(file["vertices"][:], file["triangles"][:])
body = OneBody.from_mesh(mesh)
body.save(snakemake.output[0])
drag = FORCE_UNIT * body.drag()
print(f"{len(mesh.triangles)} elements, {len(body.factor)} unknowns, isolated sphere {drag:.8f}")
