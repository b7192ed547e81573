"""Which rules read which key of the configuration, found in the text of the rules and the plan.

A rule reads what its own lines look up in `config`, and what the constants and functions that
they name look up: SHARDS among its inputs stands for the numbers of scenes and the size of a shard.
"""

import ast
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

from snakemake.parser import parse
from snakemake.sourcecache import LocalSourceFile

from workflow.library import ROOT

Key = tuple[str, ...]
"""The names that lead to a key or to a section; of the whole configuration, none."""


PLAN = "plan"
"""Reader of what stands among the inputs of any rule: it decides which jobs there are."""


def readers() -> dict[str, frozenset[Key]]:
    """Map the plan, and each rule that makes a file, to the keys and sections that it reads."""
    snakefile = _tree(ROOT / "Snakefile")
    included = [
        _tree(ROOT / ast.literal_eval(node.args[0]))
        for node in ast.walk(snakefile)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "workflow.include"
    ]
    names: dict[str, ast.AST] = {}
    rules: dict[str, list[ast.expr]] = {PLAN: []}
    for tree in (_tree(ROOT / "workflow" / "plan.py"), *included, snakefile):
        for node in tree.body:
            match node:
                case ast.FunctionDef(name=name, decorator_list=[_, *_] as lines):
                    directives = {ast.unparse(line).split("(")[0]: line for line in lines}
                    rules[PLAN] += filter(None, [directives.get("workflow.input")])
                    if "workflow.output" in directives:
                        rules[name.removeprefix("__rule_")] = lines
                case ast.FunctionDef(name=name):
                    names[name] = node
                case ast.Assign(targets=[ast.Name(name)], value=value):
                    names[name] = value
    return {
        rule: frozenset(key for line in lines for key in _looked_up(line, names))
        for rule, lines in rules.items()
    }


def read_by(key: str, found: dict[str, frozenset[Key]]) -> list[str]:
    """The readers, of those that `readers` found, of a key written with dots.

    The rule that writes the whole configuration down is left out.
    """
    path = tuple(key.split("."))
    return [
        rule for rule, keys in found.items() if any(own and path[: len(own)] == own for own in keys)
    ]


def _tree(path: Path) -> ast.Module:
    """Python of a file; Snakemake's parser makes decorators of the lines of a rule."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        opened = SimpleNamespace(open=lambda file: StringIO(text))
        text, _ = parse(LocalSourceFile(str(path)), SimpleNamespace(sourcecache=opened), {})
    return ast.parse(text)


def _looked_up(
    node: ast.AST, names: dict[str, ast.AST], sections: dict[str, Key] | None = None
) -> Iterator[Key]:
    """Keys and sections that code looks up in `config`, itself or through what it names.

    names: constants and functions that it may name. sections: what stands for a section in the
    function around it, like `settle` for ("sedimentation",).
    """
    sections = {"config": ()} if sections is None else sections
    parts = list(ast.iter_child_nodes(node))
    match node:
        case ast.Name() | ast.Subscript() if (key := _section(node, sections)) is not None:
            yield key
            return
        case ast.Assign([ast.Name(name)], value) if (key := _section(value, sections)) is not None:
            sections[name] = key
            return
        case ast.Assign([ast.Tuple(targets)], ast.Tuple(values)) if len(targets) == len(values):
            parts = [ast.Assign([one], value) for one, value in zip(targets, values, strict=True)]
        case ast.Name(name) | ast.Attribute(ast.Name("plan"), name) if name in names:
            yield from _looked_up(names[name], names)
            return
        case ast.Call(
            ast.Name(name) | ast.Attribute(ast.Name("plan"), name),
            [ast.Name("config"), *arguments],
        ) if name in names:
            # The function looks up for itself what it needs of the configuration.
            parts = [node.func, *arguments, *node.keywords]
    for part in parts:
        yield from _looked_up(part, names, sections)


def _section(node: ast.AST, sections: dict[str, Key]) -> Key | None:
    """What an expression like `config["scenes"]["number"]` looks up; None for any other."""
    match node:
        case ast.Name(name):
            return sections.get(name)
        case ast.Subscript(outer, ast.Constant(str(name))):
            of = _section(outer, sections)
            return None if of is None else (*of, name)
    return None
