"""What the model does not describe, and files that are none, stop the solver with a sentence."""

import numpy as np
import pytest

from tests.openfoam.conftest import random_cloud

CLOUD = "constant/kinematicCloudProperties"
PARCELS = "0/lagrangian/kinematicCloud"


@pytest.fixture
def case(make_case):
    return make_case(random_cloud(particles=30), steps=1)


def test_an_untouched_case_is_not_refused_and_says_what_it_loaded(case):
    output = " ".join(case.run().split())
    assert "neighbourDrag: model anchored with 5 neighbours, SHA-256 " in output
    assert "for kinematicCloud, a Cloud<basicKinematicCollidingParcel>" in output


def test_a_missing_model_is_named(case):
    case.change(CLOUD, ("constant/forceModel", "constant/other"))
    assert f"There is no file {case.folder}/constant/other".replace(" /", ' "/') in case.refusal()


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("version 1;", "version 2;", "has version 2, and this reader knows 1"),
        ("dustfall exported force model", "something else", "holds no dustfall exported"),
        ("neighbours 5;", "neighbours 4;", "the force model's file"),
        ("unit 0.00", "unit 0.01", "do not match its checksum"),
        ("test_scenes (", "scenes (", "test_scenes"),
        ('frame "canonical";', 'frame "flow";', "do not match its checksum"),
        ("reflections 2;", "reflections two;", "reflections"),
    ],
)
def test_a_damaged_or_foreign_model_is_refused(old, new, sentence, case):
    case.change("constant/forceModel", (old, new))
    assert sentence in case.refusal()


@pytest.mark.parametrize("kept", [0.05, 0.5, 0.99])
def test_half_a_model_is_refused(kept, case):
    path = case.folder / "constant/forceModel"
    text = path.read_text()
    path.write_text(text[: int(kept * len(text))])
    assert "forceModel" in case.refusal()


def test_parcels_of_unequal_diameters_are_refused(case):
    sizes = "\n".join(["30", "(", *["25e-6"] * 29, "26e-6", ")"])
    case.change(f"{PARCELS}/d", ("30{2.5e-05}", sizes))
    assert "the force model is one of equal spheres" in case.refusal()


def test_parcels_of_many_particles_are_refused(case):
    case.change(f"{PARCELS}/nParticle", ("30{1}", "30{7}"))
    assert "A parcel stands for another number of particles than one" in case.refusal()


def test_coincident_parcels_are_refused(make_case):
    start = random_cloud(particles=30)
    start.position[7] = start.position[3]
    assert "at the centre of the reference sphere" in make_case(start, steps=1).refusal()


def test_parcels_that_cannot_be_told_apart_are_refused(case):
    case.change(f"{PARCELS}/origId", ("\n7\n", "\n6\n"))
    assert "Two parcels have the same origProc and origId" in case.refusal()


def test_fewer_parcels_than_the_model_needs_are_refused_or_isolated(make_case):
    start = random_cloud(particles=5, phi=1e-3)
    case = make_case(start, steps=1)
    assert "There are 5 parcels: the force model needs 6" in case.refusal()
    case.change(
        CLOUD,
        (
            'model   "constant/forceModel";',
            'model "constant/forceModel";\n            fewParcels isolated;',
        ),
    )
    case.run()
    _, velocities, _ = case.frames()
    fall = np.array([0.0, 0.0, -1.0])
    relaxed = fall + np.exp(-0.1) * (velocities[0] - fall)
    np.testing.assert_allclose(velocities[1], relaxed, rtol=0, atol=1e-12)
    case.change(CLOUD, ("fewParcels isolated;", "fewParcels ignored;"))
    assert "refuse or isolated are allowed" in case.refusal()


def test_a_steady_cloud_is_refused(case):
    case.change(CLOUD, ("transient       yes;", "transient no; calcFrequency 1; maxTrackTime 1;"))
    assert "needs a transient cloud" in case.refusal()


def test_periods_that_are_not_along_an_axis_are_refused(case):
    mesh = "system/blockMeshDict"
    for corner in ("0 0 $side", "$side 0 $side", "$side $side $side", "0 $side $side"):
        x, y, z = corner.split()
        shifted = {"0": "$fifth", "$side": "$more"}[x]
        case.change(mesh, (f"    ({corner})\n", f"    ({shifted} {y} {z})\n"))
    side = float((case.folder / "settings").read_text().split("side ")[1].split(";")[0])
    with (case.folder / "settings").open("a") as file:
        file.write(f"fifth {0.2 * side!r};\nmore {1.2 * side!r};\n")
    assert "are not a period along x, y or z" in case.refusal()


def test_rotational_periods_are_refused(case):
    """A quarter of a tube, whose ends of the angle are a cyclic pair."""
    mesh = case.folder / "system/blockMeshDict"
    text = mesh.read_text()
    corners = "(2 0 0) (3 0 0) (0 3 0) (0 2 0) (2 0 1) (3 0 1) (0 3 1) (0 2 1)"
    a, b = text.index("vertices"), text.index("boundary")
    text = (
        f"{text[:a]}scale 1e-3;\nvertices ({corners});\n"
        "blocks (hex (0 1 2 3 4 5 6 7) (2 6 2) simpleGrading (1 1 1));\n"
        "edges (arc 0 3 (1.4142135623731 1.4142135623731 0) arc 1 2 (2.1213203435596 "
        "2.1213203435596 0)\n arc 4 7 (1.4142135623731 1.4142135623731 1) "
        f"arc 5 6 (2.1213203435596 2.1213203435596 1));\n{text[b:]}"
    )
    turn = "transform rotational; rotationAxis (0 0 1); rotationCentre (0 0 0);"
    for name in ("south", "north"):
        text = text.replace(f"{name} {{ type cyclic;", f"{name} {{ type cyclic; {turn}")
    for old in (
        "west  { type cyclic; neighbourPatch east;",
        "east  { type cyclic; neighbourPatch west;",
    ):
        assert old in text
        text = text.replace(old, f"{old[:4]} {{ type wall;")
    mesh.write_text(text)
    case.change(
        "0/U",
        (
            '".*" { type cyclic; }',
            '".*" { type cyclic; } west { type noSlip; } east { type noSlip; }',
        ),
    )
    assert "Cyclic patches turn the flow" in case.refusal()
