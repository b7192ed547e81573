"""Which artefacts a configuration asks for, and how they are named."""

from decimal import Decimal
from itertools import chain, repeat
from math import ceil
from typing import NamedTuple
from zlib import crc32


class Case(NamedTuple):
    """One run of the sedimentation solver."""

    particles: int
    volume_fraction: float
    galileo_multiple: float
    seed: int = 1
    compared_model: str = ""
    """Force model beside that of `sedimentation.model`."""

    @property
    def start(self) -> str:
        """Name of the random start, like n1000_phi1e-03_ga1 or ..._ga1_seed2: models share it.

        The first seed is not named: asking for more of them leaves the runs at hand as they are.
        """
        # All digits that tell phi from another number, and no more.
        mantissa, exponent = f"{Decimal(repr(self.volume_fraction)):e}".split("e")
        phi = f"{mantissa}e{int(exponent):+03d}"
        seed = f"_seed{self.seed}" if self.seed > 1 else ""
        return f"n{self.particles}_phi{phi}_ga{self.galileo_multiple:.15g}{seed}"

    @property
    def name(self) -> str:
        """Name that the files of the case have: of the start, and of a model that is compared."""
        return f"{self.start}_{self.compared_model}" if self.compared_model else self.start


def shards(config: dict) -> list[str]:
    """Names of all shards, like uniform-0000: scenes are numbered and cut per radial law."""
    size = config["scenes"]["shard_size"]
    return [
        f"{law}-{shard:04d}"
        for law, number in config["scenes"]["number"].items()
        for shard in range(ceil(number / size))
    ]


def shard_scenes(config: dict, law: str, shard: str) -> tuple[int, int]:
    """Number of a shard's first scene, and the one after its last."""
    size = config["scenes"]["shard_size"]
    first = int(shard) * size
    return first, min(first + size, config["scenes"]["number"][law])


def trials(config: dict) -> list[str]:
    """Names of all trials of the sweep, like streamwise/40-40_30-30-30."""
    return [
        f"{component}/{layers.replace('/', '_')}"
        for component in ("streamwise", "lateral")
        for layers in config["idnn"]["layers"]
    ]


def trial_layers(name: str) -> str:
    """Configuration of layers that a trial's file name stands for."""
    return name.replace("_", "/")


def laws(config: dict, model: str) -> list[str]:
    """Radial laws whose scenes a model is trained on."""
    return config["idnn"]["laws_of"].get(model, config["idnn"]["laws"])


LEARNERS = ("anchored", "idnn")
"""Models that the learning curve follows."""

ABLATION = (
    *("dense", "dense_sorted", "pairwise", "idnn", "unit_vectors", "canonical", "residual"),
    *("anchored", "anchored_pairwise"),
)
"""Models of the ablation table: from the dense network to the anchored IDNN, one change a line."""

ON_A_BASELINE = ("residual", "anchored", "anchored_pairwise")
"""Those of them that stand on a baseline, and are trained like the anchored IDNN."""


def learning_curve(config: dict) -> list[str]:
    """Names of the trials of the learning curve, like anchored-30-30_10-250: model, layers, scenes.

    The IDNN has the layers of the paper.
    """
    return [
        f"{model}-{layers.replace('/', '_')}-{number}"
        for model, layers in zip(
            LEARNERS,
            (config["idnn"]["layers_of"]["anchored"], config["idnn"]["ablation_layers"]),
            strict=True,
        )
        for number in sorted(
            {
                min(number, training_scenes(config, model))
                for number in config["idnn"]["learning_curve"]
            }
        )
    ]


def training_scenes(config: dict, model: str) -> int:
    """Number of scenes that a model has for training: of its laws, without the test scenes."""
    share = config["dataset"]["test_share"]
    drawn = (config["scenes"]["number"][law] for law in laws(config, model))
    return sum(number - round(share * number) for number in drawn)


def ablation(config: dict) -> list[str]:
    """Names of the trials of the ablation table; their training scenes are of the paper's law."""
    layers = config["idnn"]["ablation_layers"]
    one_block = layers.split("/")[1]
    return [
        f"{model}-{one_block if 'dense' in model or 'pairwise' in model else layers}-all".replace(
            "/", "_"
        )
        for model in ABLATION
    ]


def trial_laws(config: dict, model: str, number: str) -> list[str]:
    """Radial laws that a trial is trained on: the ablation compares on those of all models."""
    return config["idnn"]["laws"] if number == "all" else laws(config, model)


def training(config: dict, model: str) -> dict:
    """Training settings of a model: those of all, and where it differs, its own."""
    own = "anchored" if model in ON_A_BASELINE else model
    return config["idnn"]["training"] | config["idnn"]["training_of"].get(own, {})


def cases(config: dict) -> dict[str, Case]:
    """Every sedimentation case by its name; of the first seed all, then of the next one."""
    settle = config["sedimentation"]
    galileo = settle["galileo"]
    found = [
        *(Case(n, phi, 1.0) for n in settle["particles"] for phi in settle["volume_fractions"]),
        *(
            Case(galileo["particles"], galileo["volume_fraction"], multiple)
            for multiple in galileo["multiples"]
        ),
        *(
            Case(min(settle["particles"]), phi, 1.0, compared_model=model)
            for model in settle["models"]
            if model != settle["model"]
            for phi in settle["volume_fractions"]
        ),
    ]
    numbers = chain(settle["seeds"], repeat(settle["seeds"][-1]))
    seeds = dict(zip(settle["particles"], numbers, strict=False))
    return {
        case.name: case
        for seed in range(1, max(settle["seeds"]) + 1)
        for case in (one._replace(seed=seed) for one in found)
        if seed <= seeds.get(case.particles, 1)
    }


def force_model(config: dict, case: str) -> str:
    """Force model of a case."""
    return cases(config)[case].compared_model or config["sedimentation"]["model"]


def start_file(config: dict, case: str) -> str | list[str]:
    """File that a case starts from; {case} in its name stands for the name of the case.

    Without one an empty list, which Snakemake takes for no input.
    """
    pattern = config["sedimentation"]["start_file"]
    return pattern.replace("{case}", case) if pattern else []


def case_seed(config: dict, start: str) -> int:
    """Seed of a case's start: it hangs on the campaign's seed and the name of the start alone."""
    return crc32(f"{config['seed']} {start}".encode())
