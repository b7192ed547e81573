"""Closed formulas for the force: each file of this folder is one model, its `MODEL`.

A new file is a new model: the configuration then allows its name, and the campaign compares it.
"""

from pkgutil import iter_modules

from dustfall.forces.formula import Formula, load_formula

FORMULAS: dict[str, Formula] = {
    module.name: load_formula(module.name) for module in iter_modules(__path__)
}
"""Every closed formula, by its name."""
