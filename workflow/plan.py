"""Which artefacts a configuration asks for, and how they are named."""

from collections.abc import Mapping, Sequence
from decimal import Decimal
from functools import cache
from itertools import chain, repeat
from math import ceil
from types import MappingProxyType
from typing import NamedTuple
from zlib import crc32

from dustfall.dataset import OWN_LAW
from dustfall.forces.features import KINDS
from dustfall.forces.registry import settling_models, trained_models
from dustfall.own_data import shape
from dustfall.sedimentation.closures.names import ALL_PARTICLES, BACK_FLOW
from dustfall.sedimentation.properties import Properties


class Case(NamedTuple):
    """One run of the sedimentation solver."""

    particles: int
    volume_fraction: float
    galileo_multiple: float
    seed: int = 1
    compared: str = ""
    """Force model beside that of `sedimentation.model`, or the name of another closure."""
    long: bool = False
    """Whether it lasts as long as the cloud takes to become steady, and not as the paper's do."""

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
        """Name that the files of the case have: of the start, what is compared, and how long."""
        return "_".join(filter(None, [self.start, self.compared, "long" if self.long else ""]))


def neighbours(config: dict) -> int:
    """Number of neighbours that a scene has, and that a particle of a cloud feels."""
    own = config["dataset"]["file"]
    return shape(own)[1] if own else config["scenes"]["neighbours"]


def shards(config: dict) -> list[str]:
    """Names of all shards, like uniform-0000: scenes are numbered and cut per radial law.

    A data set of one's own has none.
    """
    if config["dataset"]["file"]:
        return []
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


def first_shards(config: dict) -> list[str]:
    """Names of the first shard of each radial law that has scenes."""
    return [name for name in shards(config) if name.endswith(f"-{0:04d}")]


def shard_of(config: dict, law: str, scene: str) -> str:
    """Name of the shard that a scene is in."""
    return f"{law}-{int(scene) // config['scenes']['shard_size']:04d}"


def kept_meshes(config: dict) -> list[str]:
    """Names of the scenes whose meshes are kept, like uniform-000000: the first of each law."""
    if config["dataset"]["file"]:
        return []
    return [
        f"{law}-{scene:06d}"
        for law, number in config["scenes"]["number"].items()
        for scene in range(min(number, config["stokes"]["keep_meshes"]))
    ]


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
    if config["dataset"]["file"]:
        return [OWN_LAW]
    return config["idnn"]["laws_of"].get(model, config["idnn"]["laws"])


def figure_law(config: dict) -> str:
    """Radial law whose scenes the figures of forces show."""
    return OWN_LAW if config["dataset"]["file"] else config["figures"]["radial_law"]


def learning_curve(config: dict) -> list[str]:
    """Names of the trials of the learning curve, like anchored-30-30_10-250: model, layers, scenes.

    A model without layers of its own has those of the ablation, the paper's.
    """
    idnn = config["idnn"]
    return [
        f"{model}-{layers.replace('/', '_')}-{number}"
        for model in idnn["learning_curve_of"]
        for layers in [idnn["layers_of"].get(model, idnn["ablation_layers"])]
        for number in sorted(
            {min(number, training_scenes(config, model)) for number in idnn["learning_curve"]}
        )
    ]


def training_scenes(config: dict, model: str) -> int:
    """Number of scenes that a model has for training: of its laws, without the test scenes."""
    share = config["dataset"]["test_share"]
    if config["dataset"]["file"]:
        number, _ = shape(config["dataset"]["file"])
        return number - round(share * number)
    drawn = (config["scenes"]["number"][law] for law in laws(config, model))
    return sum(number - round(share * number) for number in drawn)


def ablation(config: dict) -> list[str]:
    """Names of the trials of the ablation table, one change a line, from the dense network on.

    Their training scenes are of the laws of all models. A network of one block has the layers of
    the IDNN's second.
    """
    layers = config["idnn"]["ablation_layers"]
    first, second = layers.replace("/", "_"), layers.split("/")[1]
    return [
        f"{model}-{first if kind.blocks == 'decomposed' else second}-all"
        for model, kind in KINDS.items()
    ]


def trial_laws(config: dict, model: str, number: str) -> list[str]:
    """Radial laws that a trial is trained on: the ablation compares on those of all models."""
    return laws(config, "idnn" if number == "all" else model)


def training(config: dict, model: str) -> dict:
    """Training settings of a model: those of all, and where it differs, its own.

    On a baseline networks overfit where others learn: each such model trains as the anchored one.
    """
    own = model if KINDS[model].baseline == "isolated" else "anchored"
    return config["idnn"]["training"] | config["idnn"]["training_of"].get(own, {})


def compared_models(config: dict) -> list[str]:
    """Force models that clouds settle with beside the campaign's; "formulas" is all of them."""
    settle = config["sedimentation"]
    formulas = [name for name in settling_models() if name not in trained_models()]
    named = [
        name
        for entry in settle["models"]
        for name in (formulas if entry == "formulas" else [entry])
    ]
    return [name for name in dict.fromkeys(named) if name != settle["model"]]


def cases(config: dict) -> Mapping[str, Case]:
    """Every sedimentation case by its name; of the first seed all, then of the next one."""
    settle = config["sedimentation"]
    galileo, long = settle["galileo"], settle["long"]
    # The plan asks for each of them again and again.
    return _cases(
        tuple(settle["particles"]),
        tuple(settle["seeds"]),
        tuple(long["particles"]),
        tuple(long["seeds"]),
        tuple(settle["volume_fractions"]),
        (galileo["particles"], galileo["volume_fraction"], *galileo["multiples"]),
        (*compared_models(config), *[BACK_FLOW] * settle["back_flow"]),
        tuple(settle["all_particles"]["particles"]),
    )


@cache
def _cases(particles, starts, lasting, lasting_starts, phis, galileo, beside, together):
    changed, phi_changed, *multiples = galileo
    # Of cases that are compared long ones say more, where there are any.
    fewest, long = min(lasting or particles), bool(lasting)
    found = [
        *(Case(n, phi, 1.0) for n in particles for phi in phis),
        *(Case(changed, phi_changed, multiple) for multiple in multiples),
        *(Case(n, phi, 1.0, long=True) for n in lasting for phi in phis),
        *(Case(fewest, phi, 1.0, compared=other, long=long) for other in beside for phi in phis),
        *(Case(n, phi, 1.0, compared=ALL_PARTICLES) for n in together for phi in phis),
    ]
    seeds, long_seeds = _seeds(particles, starts), _seeds(lasting, lasting_starts)
    by_name = {
        case.name: case
        for seed in range(1, max([*starts, *lasting_starts]) + 1)
        for case in (one._replace(seed=seed) for one in found)
        # Compared long cases have the first start only: they differ from each other by their paths.
        if seed <= (seeds, {} if case.compared else long_seeds)[case.long].get(case.particles, 1)
    }
    return MappingProxyType(by_name)


def _seeds(particles: Sequence[int], numbers: Sequence[int]) -> dict[int, int]:
    """Starts of each number of particles; the last number of starts is for those that follow."""
    return dict(zip(particles, chain(numbers, repeat(numbers[-1])), strict=False))


def settled_cases(config: dict) -> list[str]:
    """Names of the cases that tell the steady state: the long ones, and others without a long one.

    Those of other seeds count as the same case.
    """
    found = cases(config)
    lasting = {case._replace(seed=1) for case in found.values() if case.long}
    return [
        name
        for name, case in found.items()
        if case.long or case._replace(seed=1, long=True) not in lasting
    ]


def is_plain(case: Case) -> bool:
    """Whether a case has the campaign's model and properties, and their Galileo number."""
    return case.galileo_multiple == 1 and not case.compared


def largest_cases(config: dict, long: list[int]) -> list[str]:
    """Names of the plain cases with most particles, one start each, from dilute to dense.

    Of the long ones where `long` tells their numbers of particles, else of the others.
    """
    settle = config["sedimentation"]
    most, phis = max(long or settle["particles"]), sorted(settle["volume_fractions"])
    return [Case(most, phi, 1.0, long=bool(long)).name for phi in phis]


def schedule(config: dict, case: str) -> dict[str, float]:
    """Step, duration and time between frames of a case [tau]."""
    one = cases(config)[case]
    if one.long:
        return long_schedule(config, one.volume_fraction, one.galileo_multiple)
    return short_schedule(config)


def compared_closures(config: dict) -> list[str]:
    """Names of the cases by which closures are compared, one start each, at the densest phi.

    Those of the campaign's model and those of all particles, which last equally long.
    """
    densest = max(config["sedimentation"]["volume_fractions"])
    return [
        name
        for closure in ("", ALL_PARTICLES)
        for name, case in cases(config).items()
        if case == Case(case.particles, densest, 1.0, compared=closure)
    ]


def short_schedule(config: dict) -> dict[str, float]:
    """Step, duration and time between frames [tau] of a case that lasts as long as the paper's."""
    settle = config["sedimentation"]
    return {
        "step": settle["step"],
        "duration": settle["duration"],
        "save_interval": settle["save_every"],
    }


def long_schedule(config: dict, volume_fraction: float, galileo_multiple=1.0) -> dict[str, float]:
    """Step, duration and time between frames [tau] of a cloud that lasts until it is steady.

    They are set in spreading times of the cloud, and written with three digits of the step.
    """
    long = config["sedimentation"]["long"]
    unit = _properties(config, galileo_multiple).spreading_time(volume_fraction)
    step = float(f"{long['step'] * unit:.3g}")
    return {
        "step": step,
        "duration": step * round(long["duration"] / long["step"]),
        "save_interval": step * round(long["save_every"] / long["step"]),
    }


def statistics_from(config: dict, case: str) -> float:
    """Time [tau] from which a case is averaged."""
    one = cases(config)[case]
    settle = config["sedimentation"]
    if not one.long:
        return settle["statistics_from"]
    return long_statistics_from(config, one.volume_fraction, one.galileo_multiple)


def long_statistics_from(config: dict, volume_fraction: float, galileo_multiple=1.0) -> float:
    """Time [tau] from which a cloud that lasts until it is steady is averaged."""
    start = config["sedimentation"]["long"]["statistics_from"]
    return start * _properties(config, galileo_multiple).spreading_time(volume_fraction)


def _properties(config: dict, galileo_multiple: float) -> Properties:
    settle = config["sedimentation"]
    properties = Properties(**settle["properties"])
    return properties.with_galileo_multiple(galileo_multiple, settle["galileo"]["change"])


def force_model(config: dict, case: str) -> str:
    """Force model of a case among nearest neighbours."""
    compared = cases(config)[case].compared
    return config["sedimentation"]["model"] if compared in ("", BACK_FLOW) else compared


def start_file(config: dict, case: str) -> str | list[str]:
    """File that a case starts from; {case} in its name stands for the name of the case.

    Without one an empty list, which Snakemake takes for no input.
    """
    pattern = config["sedimentation"]["start_file"]
    return pattern.replace("{case}", case) if pattern else []


def start_stream(start: str) -> int:
    """Item of the random stream of a case's start: it depends on the name of the start alone."""
    return crc32(start.encode())
