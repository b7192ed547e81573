"""The networks in PyTorch: several of one shape side by side, as the folds of a validation are.

Side by side they train in half the time: small networks wait for the calls, not the arithmetic.
"""

from itertools import pairwise

import numpy as np

from dustfall.extras import extra
from dustfall.forces.features import KINDS, block_inputs
from dustfall.forces.learned import ACTIVATION, block_widths

with extra("train"):
    import torch
    from torch import nn


class Affine(nn.Module):
    """One affine layer of each of k networks: (k, b, in) to (k, b, out)."""

    def __init__(self, wide: int, narrow: int, gain: float, bias: bool, generators):
        super().__init__()
        weights = torch.empty(len(generators), narrow, wide)
        for weight, generator in zip(weights, generators, strict=True):
            nn.init.xavier_uniform_(weight, gain, generator)
        self.weight = nn.Parameter(weights.transpose(1, 2).contiguous())
        self.bias = nn.Parameter(torch.zeros(len(generators), 1, narrow)) if bias else None

    def forward(self, given: torch.Tensor) -> torch.Tensor:
        """Multiply each network's rows by its own weights."""
        if self.bias is None:
            return torch.bmm(given, self.weight)
        return torch.baddbmm(self.bias, given, self.weight)

    def of_network(self, k: int) -> tuple[np.ndarray, ...]:
        """Return the weight (out, in) and, where there is one, the bias (out,) of network k."""
        arrays = [self.weight[k].T] if self.bias is None else [self.weight[k].T, self.bias[k, 0]]
        return tuple(array.detach().cpu().numpy().copy() for array in arrays)


class Block(nn.Sequential):
    """Hidden layers of one activation, then a linear output without bias (paper, Eq. forwardPass).

    `widths` run from the inputs over the hidden layers to the outputs.
    """

    def __init__(self, widths: list[int], activation: str, generators: list[torch.Generator]):
        layers: list[nn.Module] = []
        gain = nn.init.calculate_gain(activation)  # type: ignore[arg-type]
        for wide, narrow in pairwise(widths[:-1]):
            layers.append(Affine(wide, narrow, gain, True, generators))
            layers.append(nn.Tanh() if activation == "tanh" else nn.ReLU())
        super().__init__(*layers, Affine(widths[-2], widths[-1], 1.0, False, generators))


class BlockSum(nn.Module):
    """Sum of the blocks' outputs for what they are given (`features.block_inputs`), weighted."""

    def __init__(self, blocks: list[Block], given: np.ndarray):
        super().__init__()
        self.blocks = nn.ModuleList(blocks)
        # The inputs of a block follow each other, so that what they see is one piece.
        self.pieces = []
        for number in range(len(blocks)):
            rows = np.flatnonzero(given[:, 0] == number)
            first, end = given[rows[0], 1], given[rows[-1], 1:].sum()
            self.pieces.append((slice(rows[0], rows[-1] + 1), slice(first, end)))

    def forward(self, inputs: torch.Tensor, envelope: torch.Tensor) -> torch.Tensor:
        """Map normalised inputs (k, b, neighbours, F) and envelope (k, b, block inputs)."""
        k, b = inputs.shape[:2]
        total = envelope.new_zeros(())
        for (rows, neighbours), block in zip(self.pieces, self.blocks, strict=True):
            weights = envelope[:, :, rows, None]
            times = weights.shape[2]
            seen = inputs[:, :, neighbours].reshape(k, b * times, -1)
            total = total + (block(seen).view(k, b, times, -1) * weights).sum(2)
        return total


def build(
    kind: str, layers: str, component: str, neighbours: int, generators: list[torch.Generator]
) -> BlockSum:
    """Return networks of one component with random weights, one drawn from each generator."""
    blocks = [
        Block(widths, ACTIVATION[component], generators)
        for widths in block_widths(kind, layers, component, neighbours)
    ]
    return BlockSum(blocks, block_inputs(KINDS[kind].blocks, neighbours))
