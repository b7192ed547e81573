"""Compiled evaluation of the networks: PyTorch's numbers without PyTorch."""

import numpy as np
from numba import njit

LANES = 64  # scenes that a layer carries side by side, as vectors of numbers
_TERMS = 8
_HALVINGS = 4
_LARGEST = 18.0  # tanh of it is one to 5e-16


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def evaluate(inputs, envelope, mean, scale, parameters, widths, uses, bounded, outputs):
    """Return the network's output (m, outputs) in units of its target's scale.

    inputs (m, 5, F) with their `mean` and `scale` (F,); envelope (m, uses); `parameters`, one
    vector per block (rows of a matrix, padded): each layer's weights (out, in) and biases (out,);
    `widths` (blocks, layers + 1), padded with zeros; `uses` (uses, 3), each row one use of a block:
    block, first neighbour, number of neighbours. `bounded` tells tanh from ReLU.
    """
    count, _, features = inputs.shape
    result = np.zeros((count, outputs))
    largest = max(widths.max(), 1)
    layer = np.empty((largest, LANES))
    following = np.empty((largest, LANES))
    for start in range(0, count, LANES):
        for use in range(uses.shape[0]):
            block, first, number = uses[use]
            for j in range(number):
                for k in range(features):
                    for lane in range(LANES):
                        m = min(start + lane, count - 1)
                        layer[j * features + k, lane] = (inputs[m, first + j, k] - mean[k]) / scale[
                            k
                        ]
            offset = 0
            depth = 0
            while depth + 1 < widths.shape[1] and widths[block, depth + 1] > 0:
                wide, narrow = widths[block, depth], widths[block, depth + 1]
                _affine(parameters[block], offset, layer, wide, following, narrow)
                offset += narrow * (wide + 1)
                depth += 1
                is_output = depth + 1 == widths.shape[1] or widths[block, depth + 1] == 0
                if not is_output:
                    if bounded:
                        _tanh(following, narrow)
                    else:
                        for o in range(narrow):
                            for lane in range(LANES):
                                following[o, lane] = max(following[o, lane], 0.0)
                layer, following = following, layer
            for lane in range(min(LANES, count - start)):
                for o in range(outputs):
                    result[start + lane, o] += envelope[start + lane, use] * layer[o, lane]
    return result


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _affine(parameters, offset, layer, wide, following, narrow):
    # Four inputs at a time: the sum is read and written once for four products.
    bias = offset + narrow * wide
    for o in range(narrow):
        row = offset + o * wide
        total = following[o]
        for lane in range(LANES):
            total[lane] = parameters[bias + o]
        for i in range(0, wide - 3, 4):
            w0, w1 = parameters[row + i], parameters[row + i + 1]
            w2, w3 = parameters[row + i + 2], parameters[row + i + 3]
            h0, h1, h2, h3 = layer[i], layer[i + 1], layer[i + 2], layer[i + 3]
            for lane in range(LANES):
                total[lane] += w0 * h0[lane] + w1 * h1[lane] + w2 * h2[lane] + w3 * h3[lane]
        for i in range(wide - wide % 4, wide):
            w0 = parameters[row + i]
            h0 = layer[i]
            for lane in range(LANES):
                total[lane] += w0 * h0[lane]


@njit(cache=True, nogil=True, fastmath={"contract"}, error_model="numpy")
def _tanh(layer, rows):
    # tanh x = 1 - 2/(exp 2x + 1), exp by its series on a small argument and repeated squaring:
    # the library's tanh does not vectorise and would cost most of the time. Error below 1e-9.
    for o in range(rows):
        for lane in range(LANES):
            x = min(max(layer[o, lane], -_LARGEST), _LARGEST) * (2.0 / 2**_HALVINGS)
            e = 1.0
            for term in range(_TERMS, 0, -1):
                e = 1.0 + x * e * (1.0 / term)
            for _ in range(_HALVINGS):
                e *= e
            layer[o, lane] = 1.0 - 2.0 / (e + 1.0)
