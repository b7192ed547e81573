import json

import numpy as np
import pytest

from dustfall.forces import FORMULAS
from dustfall.forces.export import export_json, export_onnx, export_openfoam
from dustfall.forces.features import describe
from tests.forces.scenes import random_neighbours

onnxruntime = pytest.importorskip("onnxruntime")


@pytest.mark.parametrize("number", [0, -1, 51, 2.5, "5"])
def test_a_formula_is_exported_for_neighbours_that_it_takes(tmp_path, number):
    for export in (export_json, export_openfoam):
        with pytest.raises(ValueError, match=f"{number!r} neighbours: allowed are 1 to 50"):
            export(FORMULAS["isolated"], tmp_path / "model", number)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["dense", "pairwise", "idnn", "anchored"])
def test_the_graph_gives_the_numbers_of_the_networks(models, kind, tmp_path):
    model = models[kind]
    path = tmp_path / "model.onnx"
    export_onnx(model, path)
    header = model.header
    neighbours = random_neighbours(70, seed=6)
    scenes = describe(kind, neighbours, header["radial_input"], header["largest_distance"])
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    given = {"inputs": scenes.inputs, "envelope": scenes.envelope}
    for component, network in model.networks.items():
        (output,) = session.run([component], given)
        expected = network.residual(scenes.inputs, scenes.envelope)
        np.testing.assert_allclose(output, expected, rtol=0, atol=1e-6)
    stored = session.get_modelmeta().custom_metadata_map["header"]
    assert json.loads(stored) == json.loads(json.dumps(header))
