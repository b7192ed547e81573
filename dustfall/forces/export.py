"""Force models in files for programs in other languages.

A whole model, frame and baseline included, goes into JSON or into an OpenFOAM dictionary, which
hold the same entries; `cpp/dustfall/force_model.hpp` reads both. The networks alone, as an ONNX
graph, go to programs that bring their own geometry.
"""

import hashlib
import json
import zlib
from collections.abc import Iterator

import numpy as np

from dustfall.extras import extra
from dustfall.files import atomic
from dustfall.forces.features import FADING, KINDS
from dustfall.forces.formula import Formula
from dustfall.forces.formulas.reflections import REFLECTIONS, pair_correction
from dustfall.forces.frames import MOST_NEIGHBOURS
from dustfall.forces.learned import ACTIVATION, LearnedModel, Network
from dustfall.streams import Purpose, stream
from dustfall.units import COMPONENTS, CONTACT, NEIGHBOURS

FORMAT = "dustfall exported force model"
VERSION = 1

REACHES = (1.5, 3.0, 10.0, 50.0, 400.0, 5000.0)
"""Largest distances [d_p] in the random test scenes of a file."""

OPSET = 17
IR_VERSION = 8


def export_json(model: LearnedModel | Formula, path, neighbours: int = NEIGHBOURS) -> None:
    """Write a whole force model to `path` as JSON; see `exported` for the entries."""
    document = json.dumps(exported(model, neighbours), indent=1)
    with atomic(path) as temporary:
        temporary.write_text(document + "\n")


def export_openfoam(model: LearnedModel | Formula, path, neighbours: int = NEIGHBOURS) -> None:
    """Write a whole force model to `path` as an OpenFOAM dictionary; see `exported`."""
    document = _dictionary(exported(model, neighbours))
    head = {"version": 2.0, "format": "ascii", "class": "dictionary", "object": model.name}
    entries = "".join(f"    {key} {value};\n" for key, value in head.items())
    with atomic(path) as temporary:
        temporary.write_text(f"FoamFile\n{{\n{entries}}}\n\n{document}")


def exported(model: LearnedModel | Formula, neighbours: int = NEIGHBOURS) -> dict:
    """Return all that a reader needs to predict the forces of a model, as plain values.

    A learned model knows the number of its neighbours; a closed formula is exported for
    `neighbours` of them. The entries are texts, numbers, flat lists of numbers (last index fastest)
    and, for networks and their blocks, the same one level deeper:

    - `format`, `version`, `model`, `neighbours`, and `sha256` of all other entries
    - `order`: "distance", where neighbours are sorted, or "given"; `frame`: "canonical" or "flow"
    - `inputs`: "unit_vectors" or "spherical", with `radial_input`; `largest_distance` [d_p];
      `envelope_power`, of 1/r (see `features.describe`)
    - `baseline`: "isolated", "stokeslets" or "mobility"; the last with a number of `reflections`
      and the polynomials `correction` (2, terms), see `formulas.reflections`
    - `block_inputs` (b, 3), see `features.block_inputs`; empty for a closed formula
    - `streamwise`, `lateral`: `activation`, `unit`, `mean`, `scale`, and `block0`, `block1` with
      `widths` and `parameters`: each layer's weights (out, in), then its biases
    - `test_scenes` (m, k, 3) and `test_forces` (m, 3), which a reader has to reproduce
    - `checksum`: CRC-32 of all entries in this order, texts as bytes, numbers as doubles

    Raises ValueError for a formula that the readers do not know, or that takes no such number of
    neighbours.
    """
    if isinstance(model, LearnedModel):
        neighbours, entries = model.neighbours, _learned(model)
    elif isinstance(neighbours, int) and 1 <= neighbours <= MOST_NEIGHBOURS:
        entries = _formula(model.name)
    else:
        raise ValueError(f"{neighbours!r} neighbours: allowed are 1 to {MOST_NEIGHBOURS}")
    scenes = _test_scenes(neighbours)
    document = {
        "format": FORMAT,
        "version": VERSION,
        "model": model.name,
        "sha256": "",
        "neighbours": neighbours,
        **entries,
        "test_scenes": scenes.ravel().tolist(),
        "test_forces": model.predict(scenes).ravel().tolist(),
    }
    document["sha256"] = hashlib.sha256(b"".join(_bytes(document))).hexdigest()
    return document | {"checksum": zlib.crc32(b"".join(_bytes(document)))}


def _test_scenes(neighbours: int) -> np.ndarray:
    """Scenes (m, k, 3) of all sizes, and some where a rule for ties or contact decides."""
    rng = stream(Purpose.EXPORT, 0)
    direction = rng.normal(size=(2 * len(REACHES), neighbours, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    reach = np.repeat(REACHES, 2)[:, None, None]
    scenes = direction * rng.uniform(CONTACT, reach, (len(reach), neighbours, 1))
    touching, overlapping, tied, plane = scenes[:4].copy()
    touching /= np.linalg.norm(touching, axis=1, keepdims=True)
    overlapping[0] *= 0.5 / np.linalg.norm(overlapping[0])
    mirrors = np.array([[1, -1, 1], [-1, 1, 1], [1, 1, -1], [-1, -1, -1]])
    tied[1:5] = tied[0] * mirrors[: neighbours - 1]
    plane[:, 1] = 0.0
    return np.concatenate([scenes, [touching, overlapping, tied, plane]])


def _learned(model: LearnedModel) -> dict:
    layout = KINDS[model.name]
    given = model.networks["streamwise"].block_inputs
    return {
        "order": "distance" if layout.ordered else "given",
        "frame": "canonical" if layout.canonical else "flow",
        "inputs": "unit_vectors" if layout.unit_vectors else "spherical",
        "radial_input": model.header["radial_input"],
        "largest_distance": model.header["largest_distance"],
        "envelope_power": FADING[layout.baseline],
        **_baseline(layout.baseline),
        "block_inputs": given.ravel().tolist(),
        **{component: _network(model.networks[component]) for component in COMPONENTS},
    }


def _formula(name: str) -> dict:
    return {
        "order": "distance",
        "frame": "flow",
        "inputs": "unit_vectors",
        "radial_input": "logarithm",
        "largest_distance": 1.0,
        "envelope_power": 1,
        **_baseline(name),
        "block_inputs": [],
    }


def _baseline(name: str) -> dict:
    reflections, correction = 0, []
    if name == "reflections":
        reflections, correction = REFLECTIONS, pair_correction().ravel().tolist()
    kinds = {
        "isolated": "isolated",
        "stokeslets": "stokeslets",
        "rotne_prager": "mobility",
        "reflections": "mobility",
    }
    if name not in kinds:
        raise ValueError(f"{name!r} cannot be exported: allowed are {', '.join(kinds)}")
    return {"baseline": kinds[name], "reflections": reflections, "correction": correction}


def _network(network: Network) -> dict:
    blocks = {}
    for number, block in enumerate(network.blocks):
        widths = [block[0][0].shape[1], *(len(weight) for weight, *_ in block)]
        parameters = np.concatenate([array.ravel() for layer in block for array in layer])
        blocks[f"block{number}"] = {"widths": widths, "parameters": _numbers(parameters)}
    return {
        "activation": ACTIVATION[network.component],
        "unit": float(network.unit),
        "mean": _numbers(network.mean),
        "scale": _numbers(network.scale),
        **blocks,
    }


def _numbers(array: np.ndarray) -> list[float]:
    return array.astype(float).tolist()


def _bytes(document: dict) -> Iterator[bytes]:
    """What a checksum of a document runs over."""
    for value in document.values():
        if isinstance(value, dict):
            yield from _bytes(value)
        elif isinstance(value, str):
            yield value.encode()
        else:
            yield np.asarray(value, "<f8").tobytes()


def _dictionary(document: dict, indent: str = "") -> str:
    lines = []
    for key, value in document.items():
        if isinstance(value, dict):
            inner = _dictionary(value, indent + "    ")
            lines.append(f"{indent}{key}\n{indent}{{\n{inner}{indent}}}")
        elif isinstance(value, list):
            rows = (value[first : first + 8] for first in range(0, len(value), 8))
            text = "".join(f"\n{indent}    {' '.join(map(repr, row))}" for row in rows)
            lines.append(f"{indent}{key} ({text}\n{indent});")
        else:
            # Quotes keep a text that starts with a digit from being read as a number.
            lines.append(f"{indent}{key} {json.dumps(value)};")
    return "\n".join(lines) + "\n"


def export_onnx(model: LearnedModel, path) -> None:
    """Write the trained networks of `model` to `path`.

    The graph, in float64, maps what `features.describe` returns, `inputs` (m, k, F) and `envelope`
    (m, block inputs), to `streamwise` (m, 1) and `lateral` (m, 2) [Re_p c_D]: what the networks
    add, in the frame of the model, to its baseline. Frame and baseline are geometry and not in it.
    The model's header is the metadata "header", as JSON. Needs the package onnx.
    """
    with extra("onnx"):
        import onnx
        from onnx import TensorProto, helper

    def value(name, *shape):
        return helper.make_tensor_value_info(name, TensorProto.DOUBLE, ["m", *shape])

    nodes: list = []
    constants: list = []
    for component, network in model.networks.items():
        _add_network(nodes, constants, component, network)
    features, given = len(network.mean), len(network.block_inputs)
    graph = helper.make_graph(
        nodes,
        f"dustfall {model.name}",
        [value("inputs", model.neighbours, features), value("envelope", given)],
        [value(component, len(columns)) for component, columns in COMPONENTS.items()],
        constants,
    )
    opsets = [helper.make_opsetid("", OPSET)]
    proto = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)
    helper.set_model_props(proto, {"header": json.dumps(model.header, sort_keys=True)})
    onnx.checker.check_model(proto)
    with atomic(path) as temporary:
        temporary.write_bytes(proto.SerializeToString())


def _add_network(nodes, constants, component: str, network: Network) -> None:
    from onnx import helper, numpy_helper

    def constant(name, values):
        name = f"{component}.{name}"
        constants.append(numpy_helper.from_array(np.asarray(values), name))
        return name

    def node(operator, *given, result=None):
        result = result or f"{component}.{len(nodes)}"
        nodes.append(helper.make_node(operator, list(given), [result]))
        return result

    shifted = node("Sub", "inputs", constant("mean", network.mean.astype(float)))
    normal = node("Div", shifted, constant("scale", network.scale.astype(float)))
    axis, columns = constant("axis", [1]), constant("columns", [1])
    layers = [
        [
            [
                constant(f"{number}.{index}.{k}", array.T.astype(float))
                for k, array in enumerate(layer)
            ]
            for index, layer in enumerate(block)
        ]
        for number, block in enumerate(network.blocks)
    ]
    total = None
    for row, (block, first, count) in enumerate(network.block_inputs.tolist()):
        ends = constant(f"first.{row}", [first]), constant(f"last.{row}", [first + count])
        seen = node("Slice", normal, *ends, axis)
        width = count * len(network.mean)
        hidden = node("Reshape", seen, constant(f"width.{row}", [-1, width]))
        for weight, *bias in layers[block]:
            hidden = node("MatMul", hidden, weight)
            if bias:
                hidden = node("Add", hidden, bias[0])
                hidden = node("Tanh" if ACTIVATION[component] == "tanh" else "Relu", hidden)
        ends = constant(f"row.{row}", [row]), constant(f"next.{row}", [row + 1])
        weighted = node("Mul", hidden, node("Slice", "envelope", *ends, columns))
        total = weighted if total is None else node("Add", total, weighted)
    node("Mul", total, constant("unit", float(network.unit)), result=component)
