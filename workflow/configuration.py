"""The configuration: completed with defaults and checked before the first job.

`python -m workflow.configuration` prints the table of keys that config/README.md holds.
"""

import difflib
import math
import re
from pathlib import Path

import jsonschema
import yaml

from dustfall.forces.registry import settling_models, trained_models
from dustfall.scenes import LAWS
from dustfall.sedimentation.state import box_length
from dustfall.suspension.near_field import REACH
from workflow.readers import read_by, readers

SCHEMA = Path(__file__).parent / "schemas" / "config.schema.yaml"

ENUMS = {
    "radial laws": list(LAWS),
    "settling models": settling_models(),
    "settling models and formulas": ["formulas", *settling_models()],
    "trained models": trained_models(),
}
"""The lists of the library that the schema names by `enum_of`."""

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")

STEADY_STEPS = 20
"""Fewest steps that a steady state is averaged, and its spectrum taken, over."""


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
    if not math.isfinite(value):
        raise ConfigurationError(f"{path} is {value}, but must be {_allowed(schema)}.")
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
    laws = config["idnn"]["laws"]
    drawn = sum(scenes["number"][law] for law in laws)
    fewest = 10 * config["idnn"]["folds"]
    _require(
        drawn >= fewest,
        f"scenes.number is {drawn} in all of {', '.join(laws)}, but must be at least {fewest}, "
        f"ten scenes for each of the {config['idnn']['folds']} folds of idnn.folds.",
    )
    share = config["dataset"]["test_share"]
    for law, number in scenes["number"].items():
        _require(
            number == 0 or round(share * number) > 0,
            f"scenes.number.{law} is {number}, but must be 0 or at least "
            f"{math.ceil(0.51 / share)}, so that dataset.test_share, {share:g}, leaves a scene.",
        )
    law = figures["radial_law"]
    _require(
        scenes["number"][law] > 0,
        f"figures.radial_law is {law}, but must be a law that scenes.number draws scenes of.",
    )
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
    studies = config["studies"]
    most, fewest = max(studies["neighbours"]), min(settle["particles"])
    _require(
        most < fewest,
        f"studies.neighbours goes up to {most}, but must stay below the smallest of "
        f"sedimentation.particles, which is {fewest}.",
    )
    densest = max(settle["volume_fractions"])
    for particles in settle["all_particles"]["particles"]:
        length, needed = box_length(particles, densest), 2 * REACH
        _require(
            length > needed,
            f"sedimentation.all_particles.particles is {particles}, but must be so many that the "
            f"cube is longer than {needed:g} diameters at phi = {densest:g}; it is {length:.3g}.",
        )
    for step in studies["steps"]:
        _require_multiple("studies.duration", studies["duration"], "one of studies.steps", step)
    latest = studies["duration"] - STEADY_STEPS * max(studies["steps"])
    _require(
        studies["statistics_from"] <= latest,
        f"studies.statistics_from is {studies['statistics_from']:g} response times, but must be at "
        f"most {latest:g}, so that {STEADY_STEPS} of the largest of studies.steps follow.",
    )
    _check_times("sedimentation", settle, "response")
    _check_times("sedimentation.long", settle["long"], "spreading")


def _check_times(section: str, times: dict, unit: str) -> None:
    step, duration = times["step"], times["duration"]
    for key in ("duration", "save_every"):
        _require_multiple(f"{section}.{key}", times[key], f"{section}.step", step, unit)
    latest = duration - max(times["save_every"], STEADY_STEPS * step)
    _require(
        times["statistics_from"] <= latest,
        f"{section}.statistics_from is {times['statistics_from']:g} {unit} times, but must be at "
        f"most {latest:g}, so that {STEADY_STEPS} steps and a frame follow within "
        f"{section}.duration, which is {duration:g}.",
    )


def _require_multiple(key: str, value: float, of: str, step: float, unit: str = "response") -> None:
    steps = round(value / step)
    _require(
        steps >= 1 and abs(value - steps * step) <= 1e-9 * value,
        f"{key} is {value:g} {unit} times, but must be a multiple of {of}, which is {step:g}.",
    )


def _require(condition: bool, sentence: str) -> None:
    if not condition:
        raise ConfigurationError(sentence)


if __name__ == "__main__":
    print(reference())
