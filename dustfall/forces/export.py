"""Networks of a force model as an ONNX graph, for programs in other languages."""

import json

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from dustfall.files import atomic
from dustfall.forces.learned import ACTIVATION, LearnedModel, Network
from dustfall.units import COMPONENTS

OPSET = 17
IR_VERSION = 8


def export_onnx(model: LearnedModel, path) -> None:
    """Write the trained networks of `model` to `path`.

    The graph, in float64, maps what `features.describe` returns, `inputs` (m, k, F) and `envelope`
    (m, block inputs), to `streamwise` (m, 1) and `lateral` (m, 2) [Re_p c_D]: what the networks
    add, in the frame of the model, to its baseline. Frame and baseline are geometry and not in it.
    The model's header is the metadata "header", as JSON. Needs the package onnx.
    """
    nodes: list = []
    constants: list = []
    for component, network in model.networks.items():
        _add_network(nodes, constants, component, network)
    features, given = len(network.mean), len(network.block_inputs)
    graph = helper.make_graph(
        nodes,
        f"dustfall {model.name}",
        [_value("inputs", model.neighbours, features), _value("envelope", given)],
        [_value(component, len(columns)) for component, columns in COMPONENTS.items()],
        constants,
    )
    opsets = [helper.make_opsetid("", OPSET)]
    proto = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)
    helper.set_model_props(proto, {"header": json.dumps(model.header, sort_keys=True)})
    onnx.checker.check_model(proto)
    with atomic(path) as temporary:
        temporary.write_bytes(proto.SerializeToString())


def _value(name, *shape):
    return helper.make_tensor_value_info(name, TensorProto.DOUBLE, ["m", *shape])


def _add_network(nodes, constants, component: str, network: Network) -> None:
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
