"""The networks in PyTorch: blocks of hidden layers, and how their outputs add up."""

from itertools import pairwise

import torch
from torch import nn

from dustfall.forces.models import ACTIVATION, block_widths


class Block(nn.Sequential):
    """Hidden layers of one activation, then a linear output without bias (paper, Eq. forwardPass).

    `widths` run from the inputs over the hidden layers to the outputs.
    """

    def __init__(self, widths: list[int], activation: str, generator: torch.Generator):
        layers = []
        for wide, narrow in pairwise(widths[:-1]):
            layer = nn.Linear(wide, narrow)
            nn.init.xavier_uniform_(layer.weight, nn.init.calculate_gain(activation), generator)
            nn.init.zeros_(layer.bias)
            layers += [layer, nn.Tanh() if activation == "tanh" else nn.ReLU()]
        output = nn.Linear(widths[-2], widths[-1], bias=False)
        nn.init.xavier_uniform_(output.weight, 1.0, generator)
        super().__init__(*layers, output)


class DenseNetwork(nn.Module):
    """One block that sees the inputs of all five neighbours at once, as a flat vector."""

    def __init__(self, block: Block):
        super().__init__()
        self.blocks = nn.ModuleList([block])

    def forward(self, inputs: torch.Tensor, envelope: torch.Tensor) -> torch.Tensor:
        """Map normalised inputs (b, 5, F) and envelope (b, 4) to (b, 1 or 2)."""
        return self.blocks[0](inputs.flatten(1)) * envelope[:, :1]


class InteractionDecomposedNetwork(nn.Module):
    """IDNN: F = F_12 + F_3 + F_4 + F_5 (paper, Fig. nnModel).

    The second-order block sees the two nearest neighbours together; the first-order block, with the
    same weights for each, sees the other three one at a time.
    """

    def __init__(self, second: Block, first: Block):
        super().__init__()
        self.blocks = nn.ModuleList([second, first])

    def forward(self, inputs: torch.Tensor, envelope: torch.Tensor) -> torch.Tensor:
        """Map normalised inputs (b, 5, F) and envelope (b, 4) to (b, 1 or 2)."""
        second, first = self.blocks
        nearest = second(inputs[:, :2].flatten(1)) * envelope[:, :1]
        return nearest + (first(inputs[:, 2:]) * envelope[:, 1:, None]).sum(1)


def build(kind: str, layers: str, component: str, generator: torch.Generator) -> nn.Module:
    """Return the network of one component with random weights drawn from `generator`."""
    blocks = [
        Block(widths, ACTIVATION[component], generator)
        for widths in block_widths(kind, layers, component)
    ]
    return InteractionDecomposedNetwork(*blocks) if len(blocks) == 2 else DenseNetwork(*blocks)
