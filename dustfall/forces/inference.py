"""Compiled evaluation of the networks: PyTorch's numbers without PyTorch."""

import math

import numpy as np
from numba import njit

LANES = 128
"""Scenes side by side, the columns of a layer: wide enough for BLAS to run at speed, and for the
paper's widths few enough that it keeps the product to one thread."""

_HALVINGS = 4
_SERIES = tuple(1.0 / math.factorial(power) for power in range(8, -1, -1))  # of exp, last first
_LARGEST = 18.0  # tanh of it is one to 5e-16


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def evaluate(inputs, envelope, mean, scale, parameters, widths, block_inputs, bounded, outputs):
    """Return the network's output (m, outputs) in units of its target's scale.

    inputs (m, k, F) with their `mean` and `scale` (F,); envelope (m, block inputs); `parameters`,
    one vector per block (rows of a matrix, padded): each layer's weights (out, in) and biases
    (out,); `widths` (blocks, layers + 1), padded with zeros; `block_inputs` as of
    `features.block_inputs`. `bounded` tells tanh from ReLU.
    """
    count, _, features = inputs.shape
    result = np.zeros((count, outputs))
    largest = widths.max()
    layer = np.empty((largest, LANES))
    following = np.empty((largest, LANES))
    for start in range(0, count, LANES):
        for row in range(block_inputs.shape[0]):
            block, first, number = block_inputs[row]
            for j in range(number):
                for k in range(features):
                    for lane in range(LANES):
                        m = min(start + lane, count - 1)
                        value = inputs[m, first + j, k]
                        layer[j * features + k, lane] = (value - mean[k]) / scale[k]
            offset = 0
            depth = 0
            while depth + 1 < widths.shape[1] and widths[block, depth + 1] > 0:
                wide, narrow = widths[block, depth], widths[block, depth + 1]
                bias = offset + narrow * wide
                weights = parameters[block, offset:bias].reshape(narrow, wide)
                np.dot(weights, layer[:wide], following[:narrow])
                offset = bias + narrow
                depth += 1
                is_output = depth + 1 == widths.shape[1] or widths[block, depth + 1] == 0
                if not is_output and bounded:
                    _tanh(following, parameters[block, bias:offset])
                elif not is_output:
                    _relu(following, parameters[block, bias:offset])
                layer, following = following, layer
            for lane in range(min(LANES, count - start)):
                for o in range(outputs):
                    result[start + lane, o] += envelope[start + lane, row] * layer[o, lane]
    return result


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _relu(layer, bias):
    for o in range(len(bias)):
        for lane in range(LANES):
            layer[o, lane] = max(layer[o, lane] + bias[o], 0.0)


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _tanh(layer, bias):
    # tanh x = 1 - 2/(exp 2x + 1), exp by its series on a small argument and repeated squaring:
    # the library's tanh does not vectorise and would cost most of the time. Error below 1e-9.
    for o in range(len(bias)):
        for lane in range(LANES):
            x = layer[o, lane] + bias[o]
            x = min(max(x, -_LARGEST), _LARGEST) * (2.0 / 2**_HALVINGS)
            e = 0.0
            for coefficient in _SERIES:
                e = coefficient + x * e
            for _ in range(_HALVINGS):
                e *= e
            layer[o, lane] = 1.0 - 2.0 / (e + 1.0)
