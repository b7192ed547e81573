"""Which files of the library a script runs: its jobs are stale when one of them is edited."""

import ast
import hashlib
import os
import re
import stat
import tempfile
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

PACKAGES = ("dustfall", "openfoam")

WITHOUT_RESULTS = {
    "dustfall/extras.py",
    "dustfall/files.py",
    "dustfall/kernels.py",
    "dustfall/progress.py",
}
"""They decide where files and kernels lie and what a terminal shows, not what a result is."""

SCRIPTS = ROOT / "workflow" / "scripts"

SHIPPED = ROOT / "dustfall" / "forces" / "data" / "anchored.safetensors"
"""The model that comes with the library: what calls `load_model` without a file reads it."""

LOADS_SHIPPED = re.compile(r"\bload_model\(\)")

IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+)?import[ \t]+(\([^)]*\)|[^(\n]+)", re.MULTILINE
)
COMMENT = re.compile("#.*")


def library_files(script: str | Path) -> list[str]:
    """Files of `PACKAGES`, and what scripts share, that `script` imports, be it through others.

    Sorted paths relative to the repository root. Imports inside functions count. What a package's
    __init__ imports counts only where a name is taken from the package and not from its module.
    The model that ships is among them where one of them loads it.
    Raises ImportError for a name that a package makes up at run time: its file cannot be told.
    """
    found, waiting = set(), list(_imports(Path(script)))
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting.extend(_imports(path))
    return sorted({path.relative_to(ROOT).as_posix() for path in found} - WITHOUT_RESULTS)


def named_by(*patterns: str) -> list[str]:
    """Sorted paths, relative to the repository root, of the files that glob patterns name."""
    found = {path for pattern in patterns for path in ROOT.glob(pattern) if path.is_file()}
    return sorted(path.relative_to(ROOT).as_posix() for path in found)


def digest(files: Iterable[str]) -> str:
    """Sixteen hexadecimal digits of the names and the content of files, relative to the root."""
    found = hashlib.sha256()
    for file in files:
        found.update(f"{file} {_content(file)}\n".encode())
    return found.hexdigest()[:16]


def cache_on_node() -> Path:
    """Folder for compiled code on the disk of the machine: this user's own, made if need be.

    Numba runs what it finds there, so that a folder that someone else may write to is passed over
    for a new one.
    """
    folder = Path(tempfile.gettempdir(), f"dustfall-numba-{os.getuid()}")
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) & 0o077:
        return Path(tempfile.mkdtemp(prefix=f"{folder.name}-"))
    return folder


@cache
def _content(file: str) -> str:
    return hashlib.sha256((ROOT / file).read_bytes()).hexdigest()


@cache
def _imports(path: Path) -> frozenset[Path]:
    """Library files that the file at `path` imports or reads itself."""
    return frozenset(_imported(path))


def _imported(path: Path) -> Iterator[Path]:
    if path == SHIPPED:
        return
    code = path.read_text(encoding="utf-8")
    if LOADS_SHIPPED.search(code) and SHIPPED.is_file():
        yield SHIPPED
    if path.name == "__init__.py" and "iter_modules" in _names(path):
        # A package that looks for its modules itself has them all.
        yield from (module for module in path.parent.glob("*.py") if module != path)
    for package, names in imports_in(code):
        level = len(package) - len(package.lstrip("."))
        if level:
            parents = path.relative_to(ROOT).parts[:-level]
            package = ".".join([*parents, *filter(None, [package[level:]])])
        if not names:
            yield from _module(package) or _shared(package)
        for name in names:
            # `from package import name` names a module of the package, or what it holds.
            module = _module(f"{package}.{name}") or _module(package) or _shared(package)
            if module and module[0].stem == "__init__" and name not in _names(module[0]):
                raise ImportError(
                    f"{path} imports {name} from {package}, whose __init__.py does not "
                    f"name it: import it from its module"
                )
            yield from module


def imports_in(code: str) -> Iterator[tuple[str, list[str]]]:
    """Modules that lines of `code` import, each with the names taken from it; none for itself.

    A tenth of the time that Python's parser takes, which every start of Snakemake would wait for.
    A line of prose that reads like an import counts as one.
    """
    for package, listed in IMPORT.findall(COMMENT.sub("", code)):
        names = listed.strip("()").split(",")
        names = [name.split()[0] for name in names if name.strip()]
        yield from [(package, names)] if package else ((name, []) for name in names)


def _shared(name: str) -> list[Path]:
    """File of what scripts share, but for their logs; none for other modules."""
    return [file for file in [SCRIPTS / f"{name}.py"] if name != "joblog" and file.is_file()]


def _module(name: str) -> list[Path]:
    """File of a module of `PACKAGES`; none for other modules."""
    place = ROOT.joinpath(*name.split("."))
    files = [place.with_suffix(".py"), place / "__init__.py"]
    return [file for file in files if name.split(".")[0] in PACKAGES and file.is_file()][:1]


@cache
def _names(path: Path) -> frozenset[str]:
    """Names that a file binds by definition, assignment or import at its top."""
    names = set()
    for node in ast.parse(path.read_text(encoding="utf-8"), str(path)).body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        else:
            names |= {part.id for part in ast.walk(node) if isinstance(part, ast.Name)}
    return frozenset(names)
