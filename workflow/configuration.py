"""The configuration: completed with defaults and checked before the first job.

`python -m workflow.configuration` prints the table of keys that config/README.md holds, and
`python -m workflow.configuration config/mine.yaml` checks a file without running anything in it.
"""

import difflib
import math
import re
import sys
from collections.abc import Iterable
from itertools import count
from pathlib import Path

import jsonschema
import yaml

from dustfall.dataset import OWN_LAW
from dustfall.forces.features import FEWEST
from dustfall.forces.frames import MOST_NEIGHBOURS
from dustfall.forces.registry import settling_models, trained_models
from dustfall.own_data import shape
from dustfall.scenes import LAWS, densest
from dustfall.sedimentation.properties import MOST_GALILEO, Properties
from dustfall.sedimentation.settle import MOST_STEPS
from dustfall.sedimentation.state import box_length
from dustfall.suspension.near_field import REACH
from workflow import plan
from workflow.cost import cost
from workflow.readers import read_by, readers

SCHEMA = Path(__file__).parent / "schemas" / "config.schema.yaml"

ENUMS = {
    "radial laws": list(LAWS),
    # By Stokes drag no velocity ever changes, which leaves spectra and lifetimes nothing to tell.
    "models of a campaign": [name for name in settling_models() if name != "isolated"],
    "settling models and formulas": ["formulas", *settling_models()],
    "trained models": trained_models(),
}
"""The lists of the library that the schema names by `enum_of`."""

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")

MOST_BYTES = 10**6
"""Of a file of settings: all keys with their defaults fill four thousand."""

EXPRESSIONS = "__use_yte__"
"""Key that has Snakemake evaluate a file of settings as a template with Python in it."""

LARGEST = 2**63
"""Magnitude of a number beyond which no file of results has room for it."""

STEADY_STEPS = 20
"""Fewest steps that a steady state is averaged, and its spectrum taken, over."""

STEADY_FRAMES = 12
"""Fewest frames after its first that the spectrum of a cloud is taken over: a quarter of them lies
below the highest frequency that is fitted, and a slope needs three."""

FITTED_VALUES, HIGHEST_FITTED, SHORTEST_SEGMENT, BINS_PER_DECADE = 3, 0.25, 24, 20
"""What `analysis.spectra` needs for a slope and calls by these names; a test holds both together,
because importing it costs every start of Snakemake a second."""

RANKED_SCENES, TESTED_SCENES, TRAINED_SCENES = 3, 2, 10
"""Fewest scenes of a law for a rank correlation, of that of the figures for a variance of the test,
and of a model for its training; tests hold them to what fails with fewer, because importing PyTorch
costs every start of Snakemake seconds."""


class ConfigurationError(ValueError):
    """A setting that is refused; the message is a sentence for whoever wrote the setting."""


def load_schema() -> dict:
    """Read the JSON schema of the configuration, with the library's lists where it names them."""
    return _with_enums(yaml.safe_load(SCHEMA.read_text(encoding="utf-8")))


def configure(settings: dict) -> dict:
    """Complete `settings` with the defaults and check them.

    Returns a new dictionary with every key of the schema, numbers as int or float. Raises
    ConfigurationError with one sentence that names the key, its value and what is allowed.
    """
    schema = load_schema()
    complete = _complete(settings, schema)
    errors = jsonschema.Draft202012Validator(schema).iter_errors(complete)
    for error in sorted(errors, key=lambda error: [str(part) for part in error.absolute_path]):
        raise ConfigurationError(_sentence(error))
    _check_physics(complete)
    return complete


def read_file(path: str | Path) -> dict:
    """Read a file of settings as plain values.

    Snakemake reads such a file itself: of a key that stands there twice it takes the last, and
    where the file says so it runs the expressions in it. Raises ConfigurationError, with the line,
    for those, for anything that is no YAML, and for a file that is missing, huge or no mapping.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigurationError(f"{path} is no file; config/ holds those that come with dustfall.")
    if path.stat().st_size > MOST_BYTES:
        raise ConfigurationError(
            f"{path} has {path.stat().st_size} bytes, allowed are {MOST_BYTES}."
        )
    try:
        loader = yaml.SafeLoader(path.read_text(encoding="utf-8"))
        root = loader.get_single_node()
        settings = {} if root is None else _checked(root, path, loader)
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path} is no text in UTF-8: {error}.") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f", line {mark.line + 1}" if mark else ""
        words = getattr(error, "problem", None) or str(error)
        raise ConfigurationError(
            f"{path}{place} is no YAML: {' '.join(str(words).split())}."
        ) from None
    except (RecursionError, ValueError) as error:
        if isinstance(error, ConfigurationError):
            raise
        raise ConfigurationError(f"{path} cannot be read as YAML: {error}.") from None
    if not isinstance(settings, dict):
        raise ConfigurationError(f"{path} must hold sections and keys, like: seed: 1.")
    return settings


def _checked(root: yaml.Node, path: Path, loader: yaml.SafeLoader):
    """The value of a YAML document without keys that stand twice, aliases, or expressions."""
    waiting, seen = [root], set()
    while waiting:
        node = waiting.pop()
        line = f"{path}, line {node.start_mark.line + 1}"
        if id(node) in seen:
            raise ConfigurationError(f"{line}: an alias repeats this part, but is not allowed.")
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            waiting += node.value
        elif isinstance(node, yaml.MappingNode):
            lines: dict[str, int] = {}
            for key, value in node.value:
                name, place = str(key.value), key.start_mark.line + 1
                if name == EXPRESSIONS:
                    raise ConfigurationError(
                        f"{path}, line {place}: {name} has Snakemake run what the file says, but a "
                        "configuration holds values alone."
                    )
                if name in lines:
                    raise ConfigurationError(
                        f"{path} sets {name} twice, in line {lines[name]} and in line {place}."
                    )
                lines[name] = place
                waiting.append(value)
    return loader.construct_document(root)


def defaults(schema: dict) -> object:
    """Value that a key has when nothing is set; for a section, the defaults of its keys."""
    return _complete({} if "properties" in schema else schema["default"], schema)


def keys(schema: dict, path: str = "") -> dict[str, dict]:
    """Map each key that holds a value, written with dots, to its part of the schema."""
    found: dict[str, dict] = {}
    for name, part in schema["properties"].items():
        name = f"{path}{name}"
        found |= keys(part, f"{name}.") if "properties" in part else {name: part}
    return found


def reference() -> str:
    """Table of all keys in Markdown."""
    found = readers()
    rows = ["| key | meaning | unit | allowed | default | read by |", "|---|---|---|---|---|---|"]
    for name, part in keys(load_schema()).items():
        default = part["default"]
        shown = ", ".join(map(_show, default)) if isinstance(default, list) else _show(default)
        rows.append(
            f"| `{name}` | {part['description']} | {part.get('unit', '')} "
            f"| {_allowed(part)} | {shown} | {', '.join(read_by(name, found))} |"
        )
    return "\n".join(rows)


def _with_enums(schema):
    """A part of the schema with `enum` in place of `enum_of`."""
    if isinstance(schema, list):
        return [_with_enums(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    return {
        "enum" if key == "enum_of" else key: ENUMS[part] if key == "enum_of" else _with_enums(part)
        for key, part in schema.items()
    }


def _complete(value, schema, path=""):
    """`value` with missing keys set to their defaults and numbers as their proper type."""
    if "properties" in schema:
        if not isinstance(value, dict):
            return value
        # In the order of the schema, so that no job reruns because keys changed places in a file.
        known = schema["properties"]
        unknown = {name: part for name, part in value.items() if name not in known}
        return {
            name: _complete(value[name], part, f"{path}{name}.")
            if name in value
            else defaults(part)
            for name, part in known.items()
        } | unknown
    if isinstance(value, list):
        items = schema.get("items", {})
        return [_complete(item, items, f"{path[:-1]}[{i}].") for i, item in enumerate(value)]
    if schema.get("type") in ("integer", "number"):
        return _number(value, schema, path[:-1])
    return value


def _number(value, schema, path):
    # YAML 1.1 takes 1e-3 for a word, because it has no point.
    if isinstance(value, str) and NUMBER.fullmatch(value.strip()):
        value = float(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    if abs(value) > LARGEST or value != value:
        # Whole numbers of any length are numbers in YAML; thousands of digits help nobody.
        shown = f"{value:g}" if isinstance(value, float) else "a number of very many digits"
        raise ConfigurationError(f"{path} is {shown}, but must be {_allowed(schema)}.")
    if schema["type"] == "integer":
        return int(value) if value == int(value) else value
    return float(value)


def _sentence(error) -> str:
    path = ""
    for part in error.absolute_path:
        path += f"[{part}]" if isinstance(part, int) else f".{part}" if path else part
    known = list(error.schema.get("properties", {}))
    if error.validator == "additionalProperties":
        unknown = next(name for name in error.instance if name not in known)
        near = difflib.get_close_matches(str(unknown), known, n=1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        name = f"{path}.{unknown}" if path else unknown
        value = _show(error.instance[unknown])
        return f"{name} (set to {value}) is not a key{hint}; allowed are {', '.join(known)}."
    value = "empty" if error.instance is None else _show(error.instance)
    return f"{path} is {value}, but must be {_allowed(error.schema)}."


def _allowed(schema: dict) -> str:
    """What the schema allows, in words."""
    if "allowed" in schema:
        return schema["allowed"]
    if "enum" in schema:
        return "one of " + ", ".join(schema["enum"])
    kind = {
        "integer": "a whole number",
        "number": "a number",
        "string": "a text",
        "boolean": "true or false",
        "object": "a section with the keys " + ", ".join(schema.get("properties", {})),
        "array": "a list",
    }[schema["type"]]
    if schema["type"] == "array":
        fewest = " of at least one value and" if schema.get("minItems") else ","
        return f"{kind}{fewest} no value twice, each {_allowed(schema['items'])}"
    bounds = {
        "minimum": "at least",
        "exclusiveMinimum": "above",
        "maximum": "at most",
        "exclusiveMaximum": "below",
    }
    limits = [f"{word} {_show(schema[key])}" for key, word in bounds.items() if key in schema]
    return f"{kind} {' and '.join(limits)}" if limits else kind


def _show(value) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    return f'"{value}"' if isinstance(value, str) and NUMBER.match(value) else str(value)


def _check_physics(config: dict) -> None:
    """Refuse what each key allows alone, but not together with the others."""
    scenes, settle, figures = config["scenes"], config["sedimentation"], config["figures"]
    _require(
        scenes["phi_min"] < scenes["phi_max"],
        f"scenes.phi_min is {scenes['phi_min']:g}, but must be below scenes.phi_max, "
        f"which is {scenes['phi_max']:g}.",
    )
    if config["dataset"]["file"]:
        _check_own_data(config)
    else:
        _check_scenes(config)
    _check_neighbours(config)
    low, high = figures["fit_frequencies"]
    _require(
        low < high,
        f"figures.fit_frequencies is {low:g} to {high:g}, but must be the lower to the higher.",
    )
    fluid, particle = (settle["properties"][f"{of}_density"] for of in ("fluid", "particle"))
    _require(
        particle > fluid,
        f"sedimentation.properties.particle_density is {particle:g} kg/m³, but must be above "
        f"sedimentation.properties.fluid_density, which is {fluid:g} kg/m³.",
    )
    _check_stokes_flow(settle)
    studies = config["studies"]
    most, fewest = max(studies["neighbours"]), min(settle["particles"])
    _require(
        most < fewest,
        f"studies.neighbours goes up to {most}, but must stay below the smallest of "
        f"sedimentation.particles, which is {fewest}.",
    )
    phi = max(settle["volume_fractions"])
    for particles in settle["all_particles"]["particles"]:
        length, needed = box_length(particles, phi), 2 * REACH
        _require(
            length > needed,
            f"sedimentation.all_particles.particles is {particles}, but must be so many that the "
            f"cube is longer than {needed:g} diameters at phi = {phi:g}; it is {length:.3g}.",
        )
    for step in studies["steps"]:
        _require_multiple("studies.duration", studies["duration"], "one of studies.steps", step)
    latest = studies["duration"] - STEADY_STEPS * max(studies["steps"])
    _require(
        latest >= 0,
        f"studies.duration is {studies['duration']:g} response times, but must be at least "
        f"{STEADY_STEPS} of the largest of studies.steps, which is {max(studies['steps']):g}.",
    )
    _require(
        studies["statistics_from"] <= latest,
        f"studies.statistics_from is {studies['statistics_from']:g} response times, but must be at "
        f"most {latest:g}, so that {STEADY_STEPS} of the largest of studies.steps follow.",
    )
    _check_times("sedimentation", settle, "response")
    _check_times("sedimentation.long", settle["long"], "spreading")
    _check_frequencies(config)
    _check_start_file(config)


def _check_times(section: str, times: dict, unit: str) -> None:
    step, duration = times["step"], times["duration"]
    for key in ("duration", "save_every"):
        _require_multiple(f"{section}.{key}", times[key], f"{section}.step", step, unit)
    _require(
        STEADY_STEPS * step <= duration,
        f"{section}.duration is {duration:g} {unit} times, but must be at least {STEADY_STEPS} of "
        f"{section}.step, which is {step:g}.",
    )
    _require(
        STEADY_FRAMES * times["save_every"] <= duration,
        f"{section}.save_every is {times['save_every']:g} {unit} times, but must be at most "
        f"{duration / STEADY_FRAMES:g}, so that {STEADY_FRAMES} frames, which a spectrum needs, "
        f"follow the first within {section}.duration, which is {duration:g}.",
    )
    _require_multiple(
        f"{section}.duration", duration, f"{section}.save_every", times["save_every"], unit
    )
    latest = duration - max(STEADY_FRAMES * times["save_every"], STEADY_STEPS * step)
    _require(
        times["statistics_from"] <= latest,
        f"{section}.statistics_from is {times['statistics_from']:g} {unit} times, but must be at "
        f"most {latest:g}, so that {STEADY_STEPS} steps and {STEADY_FRAMES} frames follow within "
        f"{section}.duration, which is {duration:g}.",
    )


def _check_stokes_flow(settle: dict) -> None:
    """Refuse cases that are no Stokes flow."""
    properties = Properties(**settle["properties"])
    for multiple in sorted({1.0, *settle["galileo"]["multiples"]}):
        change = settle["galileo"]["change"]
        case = properties if multiple == 1 else properties.with_galileo_multiple(multiple, change)
        _require(
            case.galileo <= MOST_GALILEO,
            f"sedimentation.properties give a Galileo number of {case.galileo:.3g}"
            f"{'' if multiple == 1 else f' at {multiple:g} of sedimentation.galileo.multiples'}, "
            f"but must, in SI units, give at most {MOST_GALILEO:g}: beyond it the flow around a "
            "particle is no Stokes flow.",
        )


def _check_frequencies(config: dict) -> None:
    """Refuse frequencies of which the spectra of a run resolve too few to fit a slope."""
    settle = config["sedimentation"]
    low, high = config["figures"]["fit_frequencies"]
    # Spectra of single particles have a value a step, those of clouds one a frame.
    sampled = [
        ("sedimentation.step", settle["step"], settle["duration"] - settle["statistics_from"])
    ]
    lasting = settle["long"]["particles"]
    for case in plan.largest_cases(config, lasting):
        times = plan.schedule(config, case)
        key = f"sedimentation.{'long.' if lasting else ''}save_every"
        window = times["duration"] - plan.statistics_from(config, case)
        sampled.append((key, times["save_interval"], window))
    for key, interval, window in sampled:
        samples = math.floor(window / interval * (1 + 1e-9)) + 1
        # Of Welch's method, the coarser one.
        resolution = 1 / (interval * min(max(SHORTEST_SEGMENT, samples // 8), samples))
        top = min(high, HIGHEST_FITTED / interval)
        first, last = math.ceil(low / resolution), math.floor(top / resolution * (1 + 1e-9))
        lines = range(max(first, 1), last + 1)
        # Those of a value a step are averaged in bins before the fit.
        fine = key == "sedimentation.step"
        values = _bins(lines, FITTED_VALUES) if fine else len(lines)
        _require(
            values >= FITTED_VALUES,
            f"figures.fit_frequencies is {low:g} to {high:g}, but must hold at least "
            f"{FITTED_VALUES} of the frequencies that {key} resolves where the state is steady: "
            f"multiples of {resolution:.3g} up to {HIGHEST_FITTED / interval:.3g} per response "
            "time.",
        )


def _bins(lines: range, most: int) -> int:
    """Bins that hold any of these lines, at most so many; it looks at the first line of each."""
    found: set[int] = set()
    line = lines.start
    while line in lines and len(found) < most:
        own = math.floor(BINS_PER_DECADE * math.log10(line))
        found.add(own)
        line = max(line + 1, math.ceil(10 ** ((own + 1) / BINS_PER_DECADE)))
    return len(found)


def _check_start_file(config: dict) -> None:
    """Refuse a start that is a folder, or one file for clouds that differ."""
    pattern = config["sedimentation"]["start_file"]
    if not pattern:
        return
    found = plan.cases(config)
    clouds = {(case.particles, case.volume_fraction) for case in found.values()}
    _require(
        len(clouds) == 1 or "{case}" in pattern,
        f"sedimentation.start_file is {pattern}, one file for {len(clouds)} clouds of different "
        "numbers of particles or volume fractions, but must have {case} in its name.",
    )
    for case in found:
        file = plan.start_file(config, case)
        _require(
            not Path(str(file)).is_dir(),
            f"sedimentation.start_file names {file}, a folder, but must name a file.",
        )


def _check_scenes(config: dict) -> None:
    """Refuse scenes without room, and numbers of scenes that leave a stage without any."""
    scenes = config["scenes"]
    neighbours = scenes["neighbours"]
    _require(
        scenes["phi_max"] <= densest(neighbours),
        f"scenes.phi_max is {scenes['phi_max']:g}, but must be at most {densest(neighbours):.3g} "
        f"with {neighbours} of scenes.neighbours: random draws without overlap stall above.",
    )
    laws = config["idnn"]["laws"]
    drawn = sum(scenes["number"][law] for law in laws)
    fewest = 10 * config["idnn"]["folds"]
    _require(
        drawn >= fewest,
        f"scenes.number is {drawn} in all of {', '.join(laws)}, but must be at least {fewest}, "
        f"ten scenes for each of the {config['idnn']['folds']} folds of idnn.folds.",
    )
    law = config["figures"]["radial_law"]
    _require(
        scenes["number"][law] > 0,
        f"figures.radial_law is {law}, but must be a law that scenes.number draws scenes of.",
    )
    trained_on = {"idnn.laws": laws} | {
        f"idnn.laws_of.{model}": own for model, own in config["idnn"]["laws_of"].items()
    }
    for key, own in trained_on.items():
        for law in own:
            _require(
                scenes["number"][law] > 0,
                f"{key} names {law}, but must name laws that scenes.number draws scenes of.",
            )
    for law, number in scenes["number"].items():
        _check_share(config, f"scenes.number.{law} is {number}", law, number)
    share = config["dataset"]["test_share"]
    # Of the trials none has fewer: they are of these models, or of the laws of the IDNN.
    for model in trained_models():
        left = plan.training_scenes(config, model)
        key = f"idnn.laws_of.{model}"
        _require(
            left >= TRAINED_SCENES,
            f"{key if key in trained_on else 'idnn.laws'} is "
            f"{', '.join(plan.laws(config, model))}, of which scenes.number and "
            f"dataset.test_share, {share:g}, leave {left} scenes to train on, but must be laws "
            f"that leave at least {TRAINED_SCENES}.",
        )


def _check_own_data(config: dict) -> None:
    """Refuse a data set of one's own that is missing, unreadable or too small."""
    file, folds = config["dataset"]["file"], config["idnn"]["folds"]
    try:
        number, neighbours = shape(file)
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"dataset.file: {error}.") from None
    _require(
        number >= 10 * folds,
        f"dataset.file is {file}, which has {number} scenes, but must have at least {10 * folds}, "
        f"ten for each of the {folds} folds of idnn.folds.",
    )
    # They leave five scenes a fold for training.
    _check_share(config, f"dataset.file is {file}, which has {number} scenes", OWN_LAW, number)
    fewest, most = FEWEST["decomposed"], MOST_NEIGHBOURS
    _require(
        fewest <= neighbours <= most,
        f"dataset.file is {file}, which has {neighbours} neighbours a scene, but must have "
        f"{fewest} to {most}.",
    )


def _check_share(config: dict, shown: str, law: str, number: int) -> None:
    """Refuse a law with too few scenes to say anything, or with too few of them for the test."""
    share, of_figures = config["dataset"]["test_share"], law == plan.figure_law(config)
    tested = TESTED_SCENES if of_figures else 1
    fewest = next(n for n in count(RANKED_SCENES) if round(share * n) >= tested)
    _require(
        number >= fewest or (number == 0 and not of_figures),
        f"{shown}, but must {'have' if law == OWN_LAW else 'be' if of_figures else 'be 0 or'} at "
        f"least {fewest}, so that ranks of {RANKED_SCENES} can be correlated and "
        f"dataset.test_share, {share:g}, leaves {tested} for the test.",
    )


def _check_neighbours(config: dict) -> None:
    """Refuse clouds with fewer particles than a particle feels of them."""
    settle, file = config["sedimentation"], config["dataset"]["file"]
    number = plan.neighbours(config)
    of = f"the neighbours in {file}, which are" if file else "scenes.neighbours, which is"
    for key, particles in {
        "sedimentation.particles": settle["particles"],
        "sedimentation.galileo.particles": [settle["galileo"]["particles"]],
        "sedimentation.long.particles": settle["long"]["particles"],
        "studies.particles": [config["studies"]["particles"]],
    }.items():
        for fewest in sorted(particles)[:1]:
            _require(
                fewest > number,
                f"{key} {'goes down to' if len(particles) > 1 else 'is'} {fewest}, but must stay "
                f"above {of} {number}.",
            )


def _require_multiple(key: str, value: float, of: str, step: float, unit: str = "response") -> None:
    _require(
        value / step <= MOST_STEPS,
        f"{key} is {value:g} {unit} times, but must be at most {MOST_STEPS:,} times {of}, which is "
        f"{step:g}.",
    )
    steps = round(value / step)
    _require(
        steps >= 1 and abs(value - steps * step) <= 1e-9 * value,
        f"{key} is {value:g} {unit} times, but must be a multiple of {of}, which is {step:g}.",
    )


def _require(condition: bool, sentence: str) -> None:
    if not condition:
        raise ConfigurationError(sentence)


def main(files: Iterable[str]) -> None:
    """Check files of settings, or print the table of keys."""
    found = [read_file(file) for file in files]
    if not found:
        print(reference())
    for settings in found:
        print(f"This campaign takes about {cost(configure(settings))}.")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except ConfigurationError as error:
        sys.exit(f"Configuration: {error}")
