"""A solved scene as a mesh file with traction and pressure, for gmsh and ParaView.

Each element is a quadratic triangle, whose six nodes lie on the sphere. `.msh` is gmsh's own
format, with one surface for each sphere; `.vtu` is VTK's unstructured grid.
"""

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import gmsh
import numpy as np
import pandas as pd

from dustfall.files import atomic
from dustfall.stokes.elements.mesh import gmsh_session
from dustfall.stokes.elements.scene import MeshSolution
from dustfall.units import RADIUS

VTK_QUADRATIC_TRIANGLE = 22
GMSH_QUADRATIC_TRIANGLE = 9
"""Element types of both formats: three corners, then the middles of the edges 01, 12, 20."""


class SceneMesh(NamedTuple):
    """All elements of a scene.

    points: (n, 3) [d_p]. triangles: (e, 6), numbers of points. sphere: (e,), whose element it is.
    traction: (n, 3) [mu U / d_p]. pressure: (n,), its part along the inward normal, which on a
    rigid sphere is the pressure less its mean over that sphere.
    """

    points: np.ndarray
    triangles: np.ndarray
    sphere: np.ndarray
    traction: np.ndarray
    pressure: np.ndarray


def scene_mesh(solution: MeshSolution) -> SceneMesh:
    """Put the meshes of all spheres side by side.

    Raises ValueError for a scene that was not meshed, as its spheres nearly touch.
    """
    if not solution.spheres:
        raise ValueError(f"a gap of {solution.minimum_gap:.1e} d_p was not meshed")
    points, normals, triangles, owners, first = [], [], [], [], 0
    for number, sphere in enumerate(solution.spheres):
        mesh = sphere.mesh()
        middles = mesh.vertices[mesh.edges].sum(axis=1)
        middles /= np.linalg.norm(middles, axis=1, keepdims=True)
        normals.append(np.concatenate([mesh.vertices, middles]))
        points.append(sphere.centre + RADIUS * normals[-1])
        triangles.append(first + mesh.quadratic_nodes)
        owners.append(np.full(len(mesh.triangles), number))
        first += len(normals[-1])
    traction = np.concatenate(solution.traction)
    pressure = -np.einsum("ni,ni->n", np.concatenate(normals), traction)
    return SceneMesh(
        np.concatenate(points),
        np.concatenate(triangles),
        np.concatenate(owners),
        traction,
        pressure,
    )


def element_table(solution: MeshSolution) -> pd.DataFrame:
    """Outlines of all elements, for a figure: one row a node, going round each element.

    Columns: sphere, element, x, y, z [d_p], and pressure [mu U / d_p], the mean of the element's.
    """
    mesh = scene_mesh(solution)
    around = mesh.triangles[:, [0, 3, 1, 4, 2, 5]]
    count = len(around)
    x, y, z = mesh.points[around.ravel()].T
    return pd.DataFrame(
        {
            "sphere": np.repeat(mesh.sphere, 6),
            "element": np.repeat(np.arange(count), 6),
            "x": x,
            "y": y,
            "z": z,
            # On a quadratic triangle the middles of the edges alone carry the mean.
            "pressure": np.repeat(mesh.pressure[mesh.triangles[:, 3:]].mean(axis=1), 6),
        }
    )


def write_scene_mesh(path, solution: MeshSolution) -> None:
    """Write a solved scene as `.msh` or `.vtu`; ValueError for another ending."""
    writers = {".msh": _write_msh, ".vtu": _write_vtu}
    ending = Path(path).suffix
    if ending not in writers:
        raise ValueError(f"mesh file {str(path)!r}: the ending must be {' or '.join(writers)}")
    mesh = scene_mesh(solution)
    with atomic(path) as temporary:
        writers[ending](str(temporary), mesh)


def _write_msh(path: str, mesh: SceneMesh) -> None:
    with gmsh_session("scene") as model:
        numbers = np.arange(len(mesh.points)) + 1
        for sphere in np.unique(mesh.sphere):
            own = mesh.triangles[mesh.sphere == sphere]
            nodes = np.unique(own)
            tag = gmsh.model.addDiscreteEntity(2)
            gmsh.model.mesh.addNodes(2, tag, numbers[nodes], mesh.points[nodes].ravel())
            gmsh.model.mesh.addElementsByType(
                tag, GMSH_QUADRATIC_TRIANGLE, [], numbers[own].ravel()
            )
        gmsh.write(path)
        # Each view would write the mesh once more.
        gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
        for name, values in (
            ("traction [mu U / d_p]", mesh.traction),
            ("pressure [mu U / d_p]", mesh.pressure[:, None]),
        ):
            view = gmsh.view.add(name)
            gmsh.view.addModelData(view, 0, model, "NodeData", numbers, values)
            gmsh.view.write(view, path, append=True)
            gmsh.view.remove(view)


def _write_vtu(path: str, mesh: SceneMesh) -> None:
    count = len(mesh.triangles)
    grid = {
        "PointData": {"traction": mesh.traction, "pressure": mesh.pressure},
        "CellData": {"sphere": mesh.sphere},
        "Points": {"points": mesh.points},
        "Cells": {
            "connectivity": mesh.triangles.ravel(),
            "offsets": 6 * (np.arange(count) + 1),
            "types": np.full(count, VTK_QUADRATIC_TRIANGLE, dtype=np.uint8),
        },
    }
    file = ElementTree.Element("VTKFile", type="UnstructuredGrid", version="1.0")
    piece = ElementTree.SubElement(
        ElementTree.SubElement(file, "UnstructuredGrid"),
        "Piece",
        NumberOfPoints=str(len(mesh.points)),
        NumberOfCells=str(count),
    )
    kinds = {"f": "Float64", "i": "Int64", "u": "UInt8"}
    for section, arrays in grid.items():
        part = ElementTree.SubElement(piece, section)
        for name, values in arrays.items():
            components = values.shape[1] if values.ndim == 2 else 1
            array = ElementTree.SubElement(
                part, "DataArray", type=kinds[values.dtype.kind], Name=name, format="ascii",
                NumberOfComponents=str(components),
            )  # fmt: skip
            array.text = " ".join(map(repr, values.ravel().tolist()))
    ElementTree.ElementTree(file).write(path, encoding="utf-8", xml_declaration=True)
