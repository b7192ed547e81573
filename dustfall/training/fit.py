"""Training of the learned force models."""

import copy
import hashlib
from contextlib import contextmanager
from dataclasses import asdict, dataclass

import numpy as np

from dustfall import __version__
from dustfall.extras import extra
from dustfall.forces.features import KINDS, RADIAL_INPUTS, Scenes, block_inputs, describe
from dustfall.forces.frames import check_neighbours
from dustfall.forces.learned import FORMAT, VERSION, LearnedModel, Network, parse_layers
from dustfall.streams import Purpose, sequence, stream
from dustfall.training.networks import Affine, build
from dustfall.units import COMPONENTS

with extra("train"):
    import torch
    from torch import nn

VALIDATION_SHARE = 0.1
"""Share of the samples kept for validation (paper, section "Deterministic model")."""

FEWEST_VALIDATED = 2
"""Fewest samples kept for validation: the force on one has no spread that R^2 could tell of."""


@dataclass(frozen=True)
class TrainingSettings:
    """How a network is trained: AdamW on the mean squared error.

    batch_size: samples a step, 0 for all at once. epochs: at most. schedule: learning rate
    "cosine" (down to zero at the last epoch) or "constant". validate_every: epochs between
    validations. patience: epochs without a better validation error before training stops.
    """

    batch_size: int = 512
    epochs: int = 300
    learning_rate: float = 2e-2
    weight_decay: float = 1e-4
    validate_every: int = 10
    patience: int = 300
    schedule: str = "cosine"

    def __post_init__(self):
        for name, lowest in (
            ("batch_size", 0),
            ("epochs", 1),
            ("validate_every", 1),
            ("patience", 1),
        ):
            value = getattr(self, name)
            if not isinstance(value, int) or value < lowest:
                raise ValueError(f"{name} is {value!r}; it must be an integer >= {lowest}")
        if not 0 < self.learning_rate < np.inf:
            raise ValueError(f"learning_rate is {self.learning_rate!r}; it must be above 0")
        if not 0 <= self.weight_decay < np.inf:
            raise ValueError(f"weight_decay is {self.weight_decay!r}; it must be at least 0")
        if self.schedule not in ("cosine", "constant"):
            raise ValueError(f"schedule is {self.schedule!r}; it must be 'cosine' or 'constant'")


SETTINGS = {
    kind: TrainingSettings()
    if layout.baseline == "isolated"
    else TrainingSettings(batch_size=256, epochs=100, learning_rate=3e-3)
    for kind, layout in KINDS.items()
}
"""Settings that reach each kind's plateau soonest on 12,600 samples (about 20 core-seconds a
component). On a baseline networks overfit at the rate that the others need."""

PAPER_LAYERS = "40-40/30-30-30"
"""Of the paper's IDNN."""

PAPER_SETTINGS = TrainingSettings(
    batch_size=0,
    epochs=30_000,
    learning_rate=1e-3,
    weight_decay=1e-2,
    validate_every=100,
    patience=10_000,
    schedule="constant",
)
"""Full batch, patience and validation as in the paper; rate and decay, not given there, are
PyTorch's defaults for AdamW, and the epochs what an hour or so on one core takes."""

CONSTANT = 1e-9
"""Deviation of an input, over its mean or one, below which it is the rounding of a constant: a
network's input is not divided by it."""


@dataclass(frozen=True)
class History:
    """Epochs of the validations and their mean squared errors, in (Re_p c_D)^2."""

    epochs: list[int]
    validation_error: list[float]

    @property
    def best_epoch(self) -> int | None:
        """Epoch of the smallest validation error, whose weights are kept; None: none was finite."""
        finite = [error for error in self.validation_error if np.isfinite(error)]
        return self.epochs[self.validation_error.index(min(finite))] if finite else None


def fit(
    networks: nn.Module,
    tensors: list[torch.Tensor],
    splits: list[tuple[np.ndarray, np.ndarray]],
    settings: TrainingSettings,
    generators: list[torch.Generator],
    report=None,
    weight: torch.Tensor | None = None,
) -> list[History]:
    """Train k networks side by side, in place, and leave each at its best validation error.

    `tensors` are the normalised inputs (k, m, neighbours, F), envelope (k, m, block inputs) and
    target (k, m, 1 or 2); `splits` are each network's training and validation rows, `generators`
    shuffle them. In an epoch all take as many steps as the smallest training set gives. `weight`
    (m, 1) multiplies the squared errors of a row.
    `report(epoch)` is called after each epoch. Returns the histories, in the target's unit. Raises
    FloatingPointError when no validation error of a network was finite.
    """
    *given, target = tensors
    size = min(len(training) for training, _ in splits)
    batch = min(settings.batch_size or size, size)
    side = torch.arange(len(splits))[:, None]
    training = [torch.from_numpy(rows) for rows, _ in splits]
    validation, counts = _padded([rows for _, rows in splits])
    kept = copy.deepcopy(networks.state_dict())
    histories = [History([], []) for _ in splits]
    active = list(range(len(splits)))
    optimiser = torch.optim.AdamW(
        networks.parameters(),
        settings.learning_rate,
        weight_decay=settings.weight_decay,
        fused=True,
    )
    for epoch in range(1, settings.epochs + 1):
        if settings.schedule == "cosine":
            share = (epoch - 1) / settings.epochs
            rate = settings.learning_rate * 0.5 * (1 + np.cos(np.pi * share))
            optimiser.param_groups[0]["lr"] = rate
        shuffled = torch.stack(
            [
                rows[torch.randperm(len(rows), generator=generator)[:size]]
                for rows, generator in zip(training, generators, strict=True)
            ]
        )
        *shown, aim = (tensor[side, shuffled] for tensor in tensors)
        for start in range(0, size - batch + 1, batch):
            rows = slice(start, start + batch)
            error = networks(*(t[:, rows] for t in shown)) - aim[:, rows]
            squares = error.square()
            if weight is not None:
                squares = squares * weight[shuffled[:, rows]]
            loss = squares.mean((1, 2)).sum()  # each network's gradient is its own error's
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        if epoch % settings.validate_every == 0 or epoch == settings.epochs:
            with torch.no_grad():
                error = networks(*(t[side, validation] for t in given)).double()
                error = (error - target[side, validation]).square()
                if weight is not None:
                    error = error * weight[validation]
                error = error.mean(2).cpu()
            for k in list(active):
                history = histories[k]
                history.epochs.append(epoch)
                history.validation_error.append(float(error[k, : counts[k]].mean()))
                if history.best_epoch == epoch:
                    for name, value in networks.state_dict().items():
                        kept[name][k] = value[k]
                elif epoch - (history.best_epoch or epoch) >= settings.patience:
                    active.remove(k)
            if not active:
                break
        if report:
            report(epoch)
    if any(history.best_epoch is None for history in histories):
        raise FloatingPointError("training diverged: no validation error was finite")
    networks.load_state_dict(kept)
    return histories


def _padded(sets: list[np.ndarray]) -> tuple[torch.Tensor, list[int]]:
    """Rows (k, largest) of sets of rows, the shorter ones filled up, and their sizes."""
    counts = [len(rows) for rows in sets]
    filled = [np.pad(rows, (0, max(counts) - len(rows)), mode="edge") for rows in sets]
    return torch.from_numpy(np.stack(filled)), counts


def train_model(
    kind: str,
    neighbours,
    force,
    layers: str,
    settings: TrainingSettings | None = None,
    seed: int = 1,
    radial_input: str = "logarithm",
    device: str = "cpu",
    progress=None,
    weight=None,
) -> LearnedModel:
    """Train both components of a force model.

    Parameters: `kind` one of `KINDS`; `neighbours` (m, k, 3) in d_p; `force` (m, 3) in
    Re_p c_D; `layers` hidden widths as in "40-40/30-30-30" (dense and pairwise: one block);
    `settings` by default those of `SETTINGS`; `radial_input` what the spherical coordinates give
    for the distance, "distance" or "logarithm" (unit vectors come with 1/r and log r). One sample
    in ten, two at least, drawn from the seed, is kept for validation. `device` is PyTorch's, "cpu"
    or "cuda": on the CPU the same arguments give the same bits on one machine. `progress(done,
    total)` counts epochs. `weight` (m,), of a sample's squared error in training and validation;
    None: all alike.

    Raises ValueError for arguments out of range and FloatingPointError when training diverges.
    """
    parse_layers(layers, kind)
    settings = settings or SETTINGS[kind]
    neighbours, force = check_samples(neighbours, force, 10)
    weight = check_weight(weight, len(force))
    scenes, largest = training_scenes(kind, neighbours, radial_input)
    shuffled = stream(Purpose.VALIDATION, seed).permutation(len(neighbours))
    kept = max(FEWEST_VALIDATED, round(VALIDATION_SHARE * len(neighbours)))
    validation, training = np.sort(shuffled[:kept]), np.sort(shuffled[kept:])
    networks, history, scores = {}, {}, {}
    for number, component in enumerate(COMPONENTS):

        def report(epoch, done=number * settings.epochs):
            if progress:
                progress(done + epoch, len(COMPONENTS) * settings.epochs)

        split = [(training, validation)]
        ((networks[component], history[component]),) = train_networks(
            kind,
            scenes,
            force,
            component,
            layers,
            split,
            settings,
            seed,
            [0],
            report,
            device,
            weight,
        )
        scores[component] = score(networks[component], scenes, force, component, validation, weight)
    if progress:
        progress(len(COMPONENTS) * settings.epochs, len(COMPONENTS) * settings.epochs)
    layout = KINDS[kind]
    header = {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind,
        "neighbours": neighbours.shape[1],
        "layers": dict.fromkeys(COMPONENTS, layers),
        "radial_input": radial_input,
        "largest_distance": largest,
        "inputs": "1/r, log r and unit vector of each neighbour, normalised"
        if layout.unit_vectors
        else f"{radial_input} (r), azimuth and polar angle of each neighbour, normalised",
        "frame": "canonical frame of the symmetries"
        if layout.canonical
        else "flow: x spanwise, y streamwise, z vertical; polar axis z, azimuth from x to y",
        "baseline": layout.baseline,
        "units": {"length": "d_p", "force": "Re_p c_D"},
        "training": {
            "samples": len(neighbours),
            "data_sha256": data_hash(neighbours, force, *([] if weight is None else [weight])),
            "seed": int(seed),  # NumPy's integers are none of JSON's
            "settings": asdict(settings),
            "validation": scores,
            "versions": {"dustfall": __version__, "torch": torch.__version__},
        },
    }
    return LearnedModel(header, networks, history)


def train_networks(
    kind: str,
    scenes: Scenes,
    force: np.ndarray,
    component: str,
    layers: str,
    splits: list[tuple[np.ndarray, np.ndarray]],
    settings: TrainingSettings,
    seed: int,
    folds: list[int],
    report=None,
    device: str = "cpu",
    weight: np.ndarray | None = None,
) -> list[tuple[Network, History]]:
    """Train a network of one component on each split; return them with their histories.

    A split is the rows to train on and those to validate with; `folds` numbers them, 0 for the
    one of a final model. Initial weights and batches of a network depend on the seed, its number
    and the component alone.
    """
    if device != "cpu" and not torch.cuda.is_available():
        raise ValueError(f"device is {device!r}, but PyTorch finds no GPU here; use 'cpu'")
    generators = [_generator(seed, fold, list(COMPONENTS).index(component)) for fold in folds]
    target = scenes.residual(force, component)
    neighbours, features = scenes.inputs.shape[1:]
    # Training rows alone set the normalisation; validation rows must not leak into it.
    units = [float(np.sqrt(np.mean(target[rows] ** 2))) or 1.0 for rows, _ in splits]
    seen = [scenes.inputs[rows].reshape(-1, features) for rows, _ in splits]
    means, scales = [rows.mean(axis=0) for rows in seen], [rows.std(axis=0) for rows in seen]
    for mean, scale in zip(means, scales, strict=True):
        scale[scale <= CONSTANT * np.maximum(1.0, np.abs(mean))] = 1.0
    normal = [(scenes.inputs - mean) / scale for mean, scale in zip(means, scales, strict=True)]
    tensors = [
        torch.from_numpy(np.stack(arrays).astype(np.float32)).to(device)
        for arrays in (normal, [scenes.envelope] * len(splits), [target / unit for unit in units])
    ]
    heavy = weight if weight is None else torch.from_numpy(weight[:, None].astype(np.float32))
    with one_thread():
        networks = build(kind, layers, component, neighbours, generators).to(device)
        histories = fit(
            networks,
            tensors,
            splits,
            settings,
            generators,
            report,
            heavy if heavy is None else heavy.to(device),
        )
    trained = []
    for k, (mean, scale, unit, history) in enumerate(
        zip(means, scales, units, histories, strict=True)
    ):
        blocks = [
            [layer.of_network(k) for layer in block.children() if isinstance(layer, Affine)]
            for block in networks.blocks.children()
        ]
        errors = [error * unit**2 for error in history.validation_error]
        given = block_inputs(KINDS[kind].blocks, neighbours)
        network = Network(component, given, blocks, mean, scale, unit)
        trained.append((network, History(history.epochs, errors)))
    return trained


def _generator(seed: int, *items: int) -> torch.Generator:
    (state,) = sequence(Purpose.NETWORK, seed, *items).generate_state(1, np.uint64)
    return torch.Generator().manual_seed(int(state))


def score(
    network: Network,
    scenes: Scenes,
    force: np.ndarray,
    component: str,
    rows: np.ndarray,
    weight: np.ndarray | None = None,
) -> dict[str, float | None]:
    """Return the mean squared error and R^2 of a component on some rows, in float64.

    R^2 is that of the force itself, all of the component's columns together (their own means), and
    None where the force is the same in all rows: JSON has no number for it. `weight` (m,) are those
    of the samples.
    """
    target = force[rows][:, COMPONENTS[component]]
    residual = network.residual(scenes.inputs, scenes.envelope)
    error = (scenes.force(residual, component)[rows] - target) ** 2
    if weight is None:
        spread = ((target - target.mean(axis=0)) ** 2).sum()
    else:
        share = weight[rows] / weight[rows].mean()
        error = error * share[:, None]
        spread = (share @ (target - np.average(target, axis=0, weights=share)) ** 2).sum()
    varies = spread > 0 and np.ptp(target, axis=0).any()
    r2 = float(1 - error.sum() / spread) if varies else None
    return {"mse": float(error.mean()), "r2": r2}


def check_samples(neighbours, force, fewest: int) -> tuple[np.ndarray, np.ndarray]:
    """Return neighbours (m, k, 3) and force (m, 3) as float64, or raise ValueError."""
    neighbours = check_neighbours(neighbours)
    force = np.ascontiguousarray(force, dtype=float)
    if force.shape != (len(neighbours), 3):
        raise ValueError(f"force has shape {force.shape}; it must be ({len(neighbours)}, 3)")
    if not np.isfinite(force).all():
        raise ValueError("force holds a value that is not finite")
    if len(neighbours) < fewest:
        raise ValueError(f"there are {len(neighbours)} samples; training needs {fewest} or more")
    return neighbours, force


def check_weight(weight, samples: int) -> np.ndarray | None:
    """Return weights (m,) with a mean of one, or none for none. Raises ValueError for bad ones."""
    if weight is None:
        return None
    weight = np.asarray(weight, dtype=float)
    if weight.shape != (samples,) or not (np.isfinite(weight) & (weight > 0)).all():
        raise ValueError(f"weight must be {samples} finite values above 0, one a sample")
    return weight / weight.mean()


def training_scenes(kind: str, neighbours: np.ndarray, radial_input: str) -> tuple[Scenes, float]:
    """Return the scenes as networks of `kind` take them, and the largest distance among them."""
    if radial_input not in RADIAL_INPUTS:
        raise ValueError(f"radial_input is {radial_input!r}; it must be in {RADIAL_INPUTS}")
    largest = float(np.linalg.norm(neighbours, axis=2).max())
    return describe(kind, neighbours, radial_input, largest), largest


def data_hash(*arrays: np.ndarray) -> str:
    """Return the SHA-256 of the samples' bytes (float64, little endian)."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()


@contextmanager
def one_thread():
    """Run PyTorch on one thread: bits then do not depend on the machine's load or core count."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
