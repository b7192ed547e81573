"""The force models that a command line names: the one that ships, closed formulas, files."""

from pathlib import Path

HELP = "anchored (the model that ships), the name of a closed formula, or a file .safetensors"


def named_model(name: str):
    """The force model of a name or file. Raises ValueError for a name that there is not."""
    from dustfall.forces import FORMULAS, load_model

    if Path(name).suffix == ".safetensors":
        return load_model(name)
    if name in FORMULAS:
        return FORMULAS[name]
    if name == "anchored":
        return load_model()
    raise ValueError(
        f"there is no model {name!r}: allowed are anchored, {', '.join(FORMULAS)}, and files "
        "that end with .safetensors"
    )
