"""Training of the learned force models."""

import copy
import hashlib
from contextlib import contextmanager
from dataclasses import asdict, dataclass

import numpy as np
import torch
from torch import nn

from dustfall import __version__
from dustfall.forces.features import COMPONENTS, KINDS, RADIAL_INPUTS, USES, Scenes, describe
from dustfall.forces.frames import NEIGHBOURS, check_neighbours
from dustfall.forces.models import FORMAT, VERSION, LearnedModel, Network, parse_layers
from dustfall.forces.networks import build

VALIDATION_SHARE = 0.1
"""Share of the samples kept for validation (paper, section "Deterministic model")."""

# First integers of the random streams, so that no two purposes share one.
_SPLIT, _ORDER, _TRIAL = range(3)


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
    if layout.baseline == "stokes"
    else TrainingSettings(batch_size=256, epochs=100, learning_rate=3e-3)
    for kind, layout in KINDS.items()
}
"""Settings that reach each kind's plateau soonest on 12,600 samples (about 20 core-seconds a
component). On a baseline networks overfit at the rate that the others need."""

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
PyTorch's defaults for AdamW."""


@dataclass(frozen=True)
class History:
    """Epochs of the validations and their mean squared errors, in (Re_p c_D)^2."""

    epochs: list[int]
    validation_error: list[float]

    @property
    def best_epoch(self) -> int:
        """Epoch of the smallest validation error, whose weights are kept."""
        return self.epochs[int(np.argmin(self.validation_error))]


def fit(
    network: nn.Module,
    tensors: list[torch.Tensor],
    training: torch.Tensor,
    validation: torch.Tensor,
    settings: TrainingSettings,
    generator: torch.Generator,
    report=None,
) -> tuple[list[int], list[float]]:
    """Train `network` in place and leave it at its best validation error.

    `tensors` are the normalised inputs (m, 5, F), envelope (m, uses) and target (m, 1 or 2);
    `training` and `validation` are rows of them. `report(epoch)` is called after each epoch.
    Returns the validated epochs and their mean squared errors, in the target's unit. Raises
    FloatingPointError when no validation error was finite.
    """
    *given, target = tensors
    batch = min(settings.batch_size or len(training), len(training))
    optimiser = torch.optim.AdamW(
        network.parameters(), settings.learning_rate, weight_decay=settings.weight_decay, fused=True
    )
    epochs, errors, best = [], [], None
    for epoch in range(1, settings.epochs + 1):
        if settings.schedule == "cosine":
            share = (epoch - 1) / settings.epochs
            rate = settings.learning_rate * 0.5 * (1 + np.cos(np.pi * share))
            optimiser.param_groups[0]["lr"] = rate
        shuffled = training[torch.randperm(len(training), generator=generator)]
        for start in range(0, len(training) - batch + 1, batch):
            rows = shuffled[start : start + batch]
            loss = nn.functional.mse_loss(network(*(t[rows] for t in given)), target[rows])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        if epoch % settings.validate_every == 0 or epoch == settings.epochs:
            with torch.no_grad():
                predicted = network(*(t[validation] for t in given)).double()
                error = float((predicted - target[validation]).square().mean())
            epochs.append(epoch)
            errors.append(error)
            if error <= min(errors):
                best = epoch, copy.deepcopy(network.state_dict())
            elif best and epoch - best[0] >= settings.patience:
                break
        if report:
            report(epoch)
    if best is None:
        raise FloatingPointError("training diverged: no validation error was finite")
    network.load_state_dict(best[1])
    return epochs, errors


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
) -> LearnedModel:
    """Train both components of a force model.

    Parameters: `kind` one of `KINDS`; `neighbours` (m, 5, 3) in d_p; `force` (m, 3) in
    Re_p c_D; `layers` hidden widths as in "40-40/30-30-30" (dense and pairwise: one block);
    `settings` by default those of `SETTINGS`; `radial_input` what the spherical coordinates give
    for the distance, "distance" or "logarithm" (unit vectors come with 1/r and log r). One sample
    in ten, drawn from the seed, is kept for validation. `device` is PyTorch's, "cpu" or "cuda": on
    the CPU the same arguments give the same bits on one machine. `progress(done, total)` counts
    epochs.

    Raises ValueError for arguments out of range and FloatingPointError when training diverges.
    """
    parse_layers(layers, kind)
    settings = settings or SETTINGS[kind]
    neighbours, force = check_samples(neighbours, force, 10)
    scenes, largest = training_scenes(kind, neighbours, radial_input, seed)
    shuffled = np.random.default_rng([seed, _SPLIT]).permutation(len(neighbours))
    kept = max(1, round(VALIDATION_SHARE * len(neighbours)))
    validation, training = np.sort(shuffled[:kept]), np.sort(shuffled[kept:])
    networks, history, scores = {}, {}, {}
    for number, component in enumerate(COMPONENTS):

        def report(epoch, done=number * settings.epochs):
            if progress:
                progress(done + epoch, len(COMPONENTS) * settings.epochs)

        networks[component], history[component] = train_component(
            kind,
            scenes,
            force,
            component,
            layers,
            training,
            validation,
            settings,
            [seed],
            report,
            device,
        )
        scores[component] = score(networks[component], scenes, force, component, validation)
    if progress:
        progress(len(COMPONENTS) * settings.epochs, len(COMPONENTS) * settings.epochs)
    layout = KINDS[kind]
    header = {
        "format": FORMAT,
        "version": VERSION,
        "kind": kind,
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
            "data_sha256": data_hash(neighbours, force),
            "seed": seed,
            "settings": asdict(settings),
            "validation": scores,
            "versions": {"dustfall": __version__, "torch": torch.__version__},
        },
    }
    return LearnedModel(header, networks, history)


def train_component(
    kind: str,
    scenes: Scenes,
    force: np.ndarray,
    component: str,
    layers: str,
    training: np.ndarray,
    validation: np.ndarray,
    settings: TrainingSettings,
    trial: list[int],
    report=None,
    device: str = "cpu",
) -> tuple[Network, History]:
    """Train one component's network on the rows `training`; return it with its history.

    Initial weights and batches hang on `trial` (integers) and the component alone.
    """
    if device != "cpu" and not torch.cuda.is_available():
        raise ValueError(f"device is {device!r}, but PyTorch finds no GPU here; use 'cpu'")
    entropy = [*trial, _TRIAL, list(COMPONENTS).index(component)]
    (state,) = np.random.SeedSequence(entropy).generate_state(1, np.uint64)
    generator = torch.Generator().manual_seed(int(state))
    target = scenes.residual(force, component)
    # Training rows alone set the normalisation; validation rows must not leak into it.
    unit = float(np.sqrt(np.mean(target[training] ** 2))) or 1.0
    rows = scenes.inputs[training].reshape(-1, scenes.inputs.shape[2])
    mean, scale = rows.mean(axis=0), rows.std(axis=0)
    scale[scale == 0.0] = 1.0
    tensors = [
        torch.from_numpy(np.ascontiguousarray(array, dtype=np.float32)).to(device)
        for array in ((scenes.inputs - mean) / scale, scenes.envelope, target / unit)
    ]
    with one_thread():
        network = build(kind, layers, component, generator).to(device)
        epochs, errors = fit(
            network,
            tensors,
            torch.from_numpy(training),
            torch.from_numpy(validation),
            settings,
            generator,
            report,
        )
    blocks = [
        [
            tuple(p.detach().cpu().numpy().copy() for p in layer.parameters())
            for layer in block
            if isinstance(layer, nn.Linear)
        ]
        for block in network.blocks
    ]
    history = History(epochs, [error * unit**2 for error in errors])
    return Network(component, USES[KINDS[kind].blocks], blocks, mean, scale, unit), history


def score(
    network: Network, scenes: Scenes, force: np.ndarray, component: str, rows: np.ndarray
) -> dict[str, float]:
    """Return the mean squared error and R^2 of a component on some rows, in float64.

    R^2 is that of the force itself, all of the component's columns together (their own means).
    """
    target = force[rows][:, COMPONENTS[component]]
    residual = network.residual(scenes.inputs, scenes.envelope)
    error = (scenes.force(residual, component)[rows] - target) ** 2
    spread = ((target - target.mean(axis=0)) ** 2).sum()
    return {"mse": float(error.mean()), "r2": float(1 - error.sum() / spread)}


def check_samples(neighbours, force, fewest: int) -> tuple[np.ndarray, np.ndarray]:
    """Return neighbours (m, 5, 3) and force (m, 3) as float64, or raise ValueError."""
    neighbours = check_neighbours(neighbours)
    force = np.ascontiguousarray(force, dtype=float)
    if force.shape != (len(neighbours), 3):
        raise ValueError(f"force has shape {force.shape}; it must be ({len(neighbours)}, 3)")
    if not np.isfinite(force).all():
        raise ValueError("force holds a value that is not finite")
    if len(neighbours) < fewest:
        raise ValueError(f"there are {len(neighbours)} samples; training needs {fewest} or more")
    return neighbours, force


def training_scenes(
    kind: str, neighbours: np.ndarray, radial_input: str, seed: int
) -> tuple[Scenes, float]:
    """Return the scenes as networks of `kind` take them, and the largest distance among them.

    A kind that does not sort gets the neighbours of each scene in an order drawn from the seed:
    records hold them sorted, which would give away the order.
    """
    if radial_input not in RADIAL_INPUTS:
        raise ValueError(f"radial_input is {radial_input!r}; it must be in {RADIAL_INPUTS}")
    if not KINDS[kind].ordered:
        draws = np.random.default_rng([seed, _ORDER]).random((len(neighbours), NEIGHBOURS))
        neighbours = np.take_along_axis(neighbours, draws.argsort(axis=1)[:, :, None], axis=1)
    largest = float(np.linalg.norm(neighbours, axis=2).max())
    return describe(kind, neighbours, radial_input, largest), largest


def data_hash(neighbours: np.ndarray, force: np.ndarray) -> str:
    """Return the SHA-256 of the samples' bytes (float64, little endian)."""
    digest = hashlib.sha256()
    for array in (neighbours, force):
        digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()


@contextmanager
def one_thread():
    """Run PyTorch on one thread: bits then do not hang on the machine's load or core count."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
