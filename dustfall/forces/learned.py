"""Learned force models: prediction, and files that hold a model without code."""

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from dustfall.files import atomic
from dustfall.forces.features import KINDS, RADIAL_INPUTS, block_inputs, describe
from dustfall.forces.frames import MOST_NEIGHBOURS, check_neighbours
from dustfall.forces.inference import evaluate
from dustfall.units import COMPONENTS, NEIGHBOURS

FORMAT = "dustfall force model"
VERSION = 4
SHIPPED = Path(__file__).parent / "data" / "anchored.safetensors"

MOST_BYTES = 2**30
"""Of a model file: a hundred million weights."""

ACTIVATION = {"streamwise": "relu", "lateral": "tanh"}
"""Activation of each component's hidden layers (paper, section "Deterministic model")."""

INPUTS = {False: 3, True: 5}  # numbers a neighbour: spherical coordinates; 1/r, log r, unit vector


def parse_layers(layers: str, kind: str) -> list[list[int]]:
    """Return the hidden widths of each block: "40-40/30-30-30" -> [[40, 40], [30, 30, 30]].

    An IDNN has two blocks, second order / first order; a dense or pairwise network has one, as in
    "60-60".
    Raises ValueError for an unknown kind, another number of blocks, or a width below one.
    """
    if kind not in KINDS:
        raise ValueError(f"kind is {kind!r}; it must be one of {', '.join(KINDS)}")
    blocks = layers.split("/") if isinstance(layers, str) else []
    widths = [block.split("-") for block in blocks]
    decomposed = KINDS[kind].blocks == "decomposed"
    expected, example = (2, "40-40/30-30-30") if decomposed else (1, "60-60")
    if len(widths) != expected or not all(
        width.isascii() and width.isdigit() and int(width) > 0 for row in widths for width in row
    ):
        raise ValueError(f"layers is {layers!r}; {kind} takes hidden widths such as {example!r}")
    return [[int(width) for width in row] for row in widths]


def block_widths(kind: str, layers: str, component: str, neighbours: int) -> list[list[int]]:
    """Return each block's widths from its inputs over the hidden layers to its outputs."""
    layout = KINDS[kind]
    seen = {block: number for block, _, number in block_inputs(layout.blocks, neighbours).tolist()}
    return [
        [seen[block] * INPUTS[layout.unit_vectors], *hidden, len(COMPONENTS[component])]
        for block, hidden in enumerate(parse_layers(layers, kind))
    ]


def multiplications(kind: str, layers: str, component: str, neighbours: int = NEIGHBOURS) -> int:
    """Return how often a prediction of one component multiplies by a weight: its cost."""
    widths = block_widths(kind, layers, component, neighbours)
    return sum(
        wide * narrow
        for block in block_inputs(KINDS[kind].blocks, neighbours)[:, 0]
        for wide, narrow in pairwise(widths[block])
    )


@dataclass(frozen=True)
class Network:
    """Trained weights of one component's network.

    block_inputs: what its blocks are given, see `features.block_inputs`. blocks: per block, per
    layer, the weight (out, in) and the bias (out,), the last layer without bias. mean and scale
    (F,) normalise the inputs; `unit` is the size of the output in Re_p c_D.
    """

    component: str
    block_inputs: np.ndarray
    blocks: list[list[tuple[np.ndarray, ...]]]
    mean: np.ndarray
    scale: np.ndarray
    unit: float

    @property
    def parameters(self) -> int:
        """Number of trained weights and biases."""
        return sum(array.size for block in self.blocks for layer in block for array in layer)

    def residual(self, inputs: np.ndarray, envelope: np.ndarray) -> np.ndarray:
        """Output (m, 1 or 2) in Re_p c_D for inputs (m, k, F) and envelope (m, block inputs)."""
        parameters, widths = self._packed
        return self.unit * evaluate(
            inputs,
            envelope,
            self.mean,
            self.scale,
            parameters,
            widths,
            self.block_inputs,
            ACTIVATION[self.component] == "tanh",
            len(COMPONENTS[self.component]),
        )

    @cached_property
    def _packed(self):
        depth = max(len(block) for block in self.blocks)
        widths = np.zeros((len(self.blocks), depth + 1), np.int64)
        vectors = []
        for number, block in enumerate(self.blocks):
            parts = []
            widths[number, 0] = block[0][0].shape[1]
            for index, (weight, *bias) in enumerate(block):
                widths[number, index + 1] = len(weight)
                parts += [weight.ravel(), bias[0] if bias else np.zeros(len(weight))]
            vectors.append(np.concatenate(parts).astype(float))
        parameters = np.zeros((len(vectors), max(map(len, vectors))))
        for row, vector in zip(parameters, vectors, strict=True):
            row[: len(vector)] = vector
        return parameters, widths


class LearnedModel:
    """A force model of one of the `KINDS`, with its trained networks.

    `header` describes the model in plain values (kind, layers, inputs, units, frame, training);
    `history` holds, for a model just trained, the epochs and validation errors of each component.

    Out of range: a neighbour closer than contact is held at contact. Neighbours further away than
    any in training are seen by the networks at that distance, but for 1/r, which goes with unit
    vectors and is seen as it is. What the networks add fades with distance, so that the force goes
    over into Stokes drag (see `features.describe`).
    """

    def __init__(self, header: dict, networks: dict[str, Network], history: dict | None = None):
        self.header = header
        self.networks = networks
        self.history = history or {}

    @property
    def name(self) -> str:
        """Kind of the model, as in `KINDS`."""
        return self.header["kind"]

    @property
    def neighbours(self) -> int:
        """Number of neighbours that the model takes."""
        return self.header["neighbours"]

    def predict(self, neighbours) -> np.ndarray:
        """Return the force (m, 3) in Re_p c_D on the reference sphere at the origin.

        Parameters: `neighbours` (m, k, 3), Cartesian, in d_p, in the frame of the flow (x spanwise,
        y streamwise, z vertical). Their order does not matter, except for the paper's dense network
        of unsorted neighbours. Raises ValueError for neighbours of another shape, not finite, or at
        the centre of the reference sphere.
        """
        scenes = describe(
            self.name,
            check_neighbours(neighbours, self.neighbours),
            self.header["radial_input"],
            self.header["largest_distance"],
        )
        force = np.empty((len(scenes.inputs), 3))
        for component, network in self.networks.items():
            residual = network.residual(scenes.inputs, scenes.envelope)
            force[:, COMPONENTS[component]] = scenes.force(residual, component)
        return force

    def save(self, path) -> None:
        """Write the model to `path`: safetensors, with the header as JSON in its metadata."""
        tensors = _tensors(self.networks)
        header = {**self.header, "checksum": _checksum(self.header, tensors)}
        with atomic(path) as temporary:
            save_file(tensors, temporary, {"header": json.dumps(header, sort_keys=True)})


def load_model(path=None) -> LearnedModel:
    """Return the learned model in a file; without a path, the anchored IDNN of this package.

    Nothing in the file is executed. Raises FileNotFoundError where there is no such file, and
    ValueError for a file that is damaged, of another layout or of another format version.
    """
    shipped = path is None
    path = SHIPPED if shipped else Path(path)
    if not path.is_file():
        what = "the anchored model that ships with dustfall" if shipped else "force model"
        raise FileNotFoundError(f"{what} not found: there is no file {path}")
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"{path} has {path.stat().st_size} bytes: allowed are {MOST_BYTES}")
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            header = json.loads(metadata.get("header", "null"))
            names = list(file.keys())
            others = {file.get_slice(name).get_dtype() for name in names} - {"F32", "F64"}
            tensors = {} if others else {name: file.get_tensor(name) for name in names}
    except (SafetensorError, ValueError, RecursionError) as error:
        raise ValueError(f"{path} is damaged or no safetensors file: {error}") from error
    if others:
        raise ValueError(f"{path} holds numbers of {', '.join(sorted(others))}, not F32 or F64")
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError(f"{path} is a safetensors file, but holds no {FORMAT}")
    if header.get("version") != VERSION:
        raise ValueError(
            f"{path} has format version {header.get('version')!r}; this dustfall reads {VERSION}"
        )
    if header.pop("checksum", None) != _checksum(header, tensors):
        raise ValueError(f"{path} is damaged: header and weights do not match their checksum")
    try:
        networks = {component: _network(tensors, header, component) for component in COMPONENTS}
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path} has another layout than its header says: {error}") from error
    return LearnedModel(header, networks)


def _tensors(networks):
    tensors = {}
    for component, network in networks.items():
        tensors[f"{component}.mean"] = network.mean
        tensors[f"{component}.scale"] = network.scale
        tensors[f"{component}.unit"] = np.array([network.unit])
        for number, block in enumerate(network.blocks):
            for index, arrays in enumerate(block):
                for array, what in zip(arrays, ("weight", "bias"), strict=False):
                    tensors[f"{component}.{number}.{index}.{what}"] = np.ascontiguousarray(array)
    return tensors


def _network(tensors, header, component):
    largest = header["largest_distance"]
    # Whole numbers of JSON may be too long for a kernel.
    if (
        header["radial_input"] not in RADIAL_INPUTS
        or not isinstance(largest, float)
        or not largest > 0
    ):
        raise ValueError("radial_input or largest_distance has no allowed value")
    neighbours = header["neighbours"]
    if not (isinstance(neighbours, int) and 1 <= neighbours <= MOST_NEIGHBOURS):
        raise ValueError(f"neighbours is {neighbours!r}, not a number up to {MOST_NEIGHBOURS}")

    def tensor(name, *shape):
        array = tensors[f"{component}.{name}"]
        if array.shape != shape:
            raise ValueError(f"{component}.{name} has the shape {array.shape}, not {shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{component}.{name} holds a value that is not finite")
        return array

    widths = block_widths(header["kind"], header["layers"][component], component, neighbours)
    blocks = []
    for number, row in enumerate(widths):
        layers = []
        for index, (wide, narrow) in enumerate(pairwise(row)):
            layer = (tensor(f"{number}.{index}.weight", narrow, wide),)
            if index + 2 < len(row):
                layer += (tensor(f"{number}.{index}.bias", narrow),)
            layers.append(layer)
        blocks.append(layers)
    layout = KINDS[header["kind"]]
    features = INPUTS[layout.unit_vectors]
    mean, scale = tensor("mean", features), tensor("scale", features)
    unit = float(tensor("unit", 1)[0])
    given = block_inputs(layout.blocks, neighbours)
    return Network(component, given, blocks, mean, scale, unit)


def _checksum(header, tensors):
    digest = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in sorted(tensors):
        digest.update(f"{name} {tensors[name].dtype} {tensors[name].shape}".encode())
        digest.update(tensors[name].tobytes())
    return digest.hexdigest()
