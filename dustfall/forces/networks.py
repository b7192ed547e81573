"""The networks in PyTorch: blocks of hidden layers, and how their outputs add up."""

from itertools import pairwise

import torch
from torch import nn

from dustfall.forces.features import KINDS, USES
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


class BlockSum(nn.Module):
    """Sum of the blocks' outputs over their uses (a value of `features.USES`), each weighted."""

    def __init__(self, blocks: list[Block], uses):
        super().__init__()
        self.blocks = nn.ModuleList(blocks)
        self.uses = uses.tolist()

    def forward(self, inputs: torch.Tensor, envelope: torch.Tensor) -> torch.Tensor:
        """Map normalised inputs (b, 5, F) and envelope (b, uses) to (b, 1 or 2)."""
        total = 0.0
        for number, block in enumerate(self.blocks):
            rows = [row for row, use in enumerate(self.uses) if use[0] == number]
            seen = [inputs[:, first : first + n].flatten(1) for _, first, n in self.uses]
            outputs = block(torch.stack([seen[row] for row in rows], dim=1))
            total = total + (outputs * envelope[:, rows, None]).sum(1)
        return total


def build(kind: str, layers: str, component: str, generator: torch.Generator) -> nn.Module:
    """Return the network of one component with random weights drawn from `generator`."""
    blocks = [
        Block(widths, ACTIVATION[component], generator)
        for widths in block_widths(kind, layers, component)
    ]
    return BlockSum(blocks, USES[KINDS[kind].blocks])
