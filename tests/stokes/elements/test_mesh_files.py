"""Mesh files say what was solved, and the programs they are for can read them."""

from xml.etree import ElementTree

import gmsh
import numpy as np
import pytest

from dustfall.stokes.elements.mesh_files import element_table, scene_mesh, write_scene_mesh
from dustfall.stokes.elements.scene import fixed_spheres_on_meshes

CENTRES = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.02], [2.0, 0.0, 0.5]])


@pytest.fixture(scope="module")
def solution():
    return fixed_spheres_on_meshes(CENTRES)


def test_nodes_lie_on_their_spheres(solution):
    mesh = scene_mesh(solution)
    for own, sphere in zip(mesh.triangles, mesh.sphere, strict=True):
        distance = np.linalg.norm(mesh.points[own] - CENTRES[sphere], axis=1)
        np.testing.assert_allclose(distance, 0.5, rtol=1e-12)


def test_pressure_is_high_upstream_and_has_no_mean(solution):
    mesh = scene_mesh(solution)
    for number, sphere in enumerate(solution.spheres):
        own = np.unique(mesh.triangles[mesh.sphere == number])
        areas = sphere.exchange.spread.sum(axis=1)
        assert abs(areas @ mesh.pressure[own]) < 1e-3
        upstream = mesh.points[own, 1] < -0.4
        assert mesh.pressure[own][upstream].min() > 0.0


def test_a_lone_sphere_has_the_known_pressure():
    solution = fixed_spheres_on_meshes([[0.0, 0.0, 0.0]], tolerance=1e-5)
    mesh = scene_mesh(solution)
    # p = -(3/2) mu U cos(theta) / radius on the surface (Stokes 1851).
    np.testing.assert_allclose(mesh.pressure, -3.0 * mesh.points[:, 1] / 0.5, atol=5e-2)


def test_gmsh_reads_the_mesh_and_its_fields_back(solution, tmp_path):
    write_scene_mesh(tmp_path / "scene.msh", solution)
    mesh = scene_mesh(solution)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "scene.msh"))
        tags, points, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags)
        np.testing.assert_allclose(points.reshape(-1, 3)[order], mesh.points, atol=1e-12)
        assert len(gmsh.model.getEntities(2)) == len(CENTRES)
        fields = {}
        for view in gmsh.view.getTags():
            _, numbers, values, *_ = gmsh.view.getModelData(view, 0)
            name = gmsh.view.option.getString(view, "Name").split(" ")[0]
            fields[name] = np.array(values)[np.argsort(numbers)].squeeze()
        np.testing.assert_allclose(fields["pressure"], mesh.pressure, rtol=1e-12)
        np.testing.assert_allclose(fields["traction"], mesh.traction, rtol=1e-12)
    finally:
        gmsh.finalize()


def test_the_grid_for_paraview_holds_every_element(solution, tmp_path):
    write_scene_mesh(tmp_path / "scene.vtu", solution)
    mesh = scene_mesh(solution)
    piece = ElementTree.parse(tmp_path / "scene.vtu").getroot().find(".//Piece")
    arrays = {
        array.get("Name"): np.array(array.text.split(), dtype=float)
        for array in piece.iter("DataArray")
    }
    assert int(piece.get("NumberOfPoints")) == len(mesh.points)
    assert int(piece.get("NumberOfCells")) == len(mesh.triangles)
    np.testing.assert_array_equal(arrays["connectivity"], mesh.triangles.ravel())
    np.testing.assert_array_equal(arrays["offsets"], 6 * np.arange(1, len(mesh.triangles) + 1))
    assert set(arrays["types"]) == {22.0}
    np.testing.assert_array_equal(arrays["points"], mesh.points.ravel())
    np.testing.assert_array_equal(arrays["traction"], mesh.traction.ravel())


def test_the_table_for_figures_goes_round_each_element(solution):
    table = element_table(solution)
    assert len(table) == 6 * len(scene_mesh(solution).triangles)
    around = table[["x", "y", "z"]].to_numpy().reshape(-1, 6, 3)
    sides = np.linalg.norm(np.diff(around[:, [0, 1, 2, 3, 4, 5, 0]], axis=1), axis=2)
    # Half edges, all shorter than an edge of the plain mesh.
    assert sides.max() < 0.5


def test_other_endings_and_scenes_without_meshes_are_refused(solution, tmp_path):
    with pytest.raises(ValueError, match=r"\.msh or \.vtu"):
        write_scene_mesh(tmp_path / "scene.stl", solution)
    touching = fixed_spheres_on_meshes([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0 + 1e-9]])
    with pytest.raises(ValueError, match="not meshed"):
        write_scene_mesh(tmp_path / "scene.msh", touching)
