"""All force models by name: closed formulas, and the kinds of learned models.

Configuration, plan, tables and figures ask here; a model is entered once, as a file of
`forces.formulas` or as a line of `features.KINDS`.
"""

from dustfall.forces.features import KINDS, Kind
from dustfall.forces.formula import Formula
from dustfall.forces.formulas import FORMULAS

FORCE_MODELS: dict[str, Formula | Kind] = {**FORMULAS, **KINDS}
"""Every force model, by its name: closed formulas, and kinds that have to be trained."""


def title(name: str) -> str:
    """What figures and tables call a force model. Raises ValueError for an unknown one."""
    if name not in FORCE_MODELS:
        raise ValueError(f"{name!r} is no force model; there are {', '.join(FORCE_MODELS)}")
    return FORCE_MODELS[name].title


def trained_models() -> list[str]:
    """Learned models that a campaign trains on all that they may learn from."""
    return [name for name, kind in KINDS.items() if kind.final]


def settling_models() -> list[str]:
    """Models that clouds can settle with: formulas of positive drag, and trained models."""
    return [name for name, formula in FORMULAS.items() if formula.settles] + trained_models()
