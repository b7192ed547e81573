import json

import numpy as np
import pytest

from dustfall.forces.features import describe
from tests.forces.scenes import random_neighbours

onnxruntime = pytest.importorskip("onnxruntime")


@pytest.mark.parametrize("kind", ["dense", "pairwise", "idnn", "anchored"])
def test_the_graph_gives_the_numbers_of_the_networks(models, kind, tmp_path):
    from dustfall.forces.export import export_onnx

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
