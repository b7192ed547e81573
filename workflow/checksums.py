"""Checksums of all that a campaign makes: written by the job that makes a file, checked by readers.

Beside `results/<file>` lies `results/checksums/<file>.sha256`, one line as the tool sha256sum
writes and reads it. It covers every byte of a file of any format, headers included, before a
library opens the file, and leaves tables and pictures as other programs expect them.
"""

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

RESULTS = Path("results")
"""Of a campaign by itself; as a module of another workflow it has them below a prefix."""

FOLDER = "checksums"

CHECKPOINTS = "checkpoints"
"""Folder of unfinished runs, which vouch for themselves."""


class DamageError(ValueError):
    """A file of the campaign is not what its job wrote; the message says what to do."""


def results_of(log: str | Path) -> Path:
    """The folder `results` of the campaign whose folder `logs` a log of a job lies in."""
    parts = Path(log).parts
    before = len(parts) - 1 - parts[::-1].index("logs") if "logs" in parts else 0
    return Path(*parts[:before], RESULTS)


def seal(files: Iterable[str | Path], results: Path = RESULTS) -> None:
    """Write the checksum of each of the files that lies in `results`."""
    for path in _own(files, results):
        place = _place(path, results)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(f"{_digest(path)}  {path.as_posix()}\n", encoding="utf-8")


def check(files: Iterable[str | Path], results: Path = RESULTS) -> None:
    """Raise DamageError unless each of the files in `results` has the bytes that its job wrote.

    What lies elsewhere is the user's own.
    """
    for path in _own(files, results):
        complaint = _complaint(path, results)
        if complaint:
            raise DamageError(f"{complaint}; `snakemake verify` names all such files")


def verify(results: Path = RESULTS) -> Iterator[tuple[Path, str]]:
    """Yield every file of `results`, there or lost, with what is wrong about it, if anything."""
    folder = results / FOLDER
    made = {
        results / place.relative_to(folder).with_suffix("")
        for place in folder.rglob("*.sha256")
        if place.is_file()
    }
    there = {path for path in _own(results.rglob("*"), results) if path.is_file()}
    for path in sorted(made | {path for path in there if folder not in path.parents}):
        yield path, _complaint(path, results)


def _complaint(path: Path, results: Path) -> str:
    """What is wrong with a file of the campaign, and what to do; nothing for a whole one."""
    again = f"remove it (rm '{path}') and give the same command again, which makes it anew"
    if not path.is_file():
        return f"{path} is lost; the same command given again makes it anew"
    try:
        line = _place(path, results).read_text(encoding="utf-8")
    except FileNotFoundError:
        folder = results / FOLDER
        return f"{path} has no checksum in {folder}, so no job of this campaign made it: {again}"
    except UnicodeDecodeError:
        line = ""
    if line != f"{_digest(path)}  {path.as_posix()}\n":
        return f"{path} is damaged, it is not what its job wrote: {again}"
    return ""


def _own(files: Iterable[str | Path], results: Path) -> Iterator[Path]:
    """Those of the files that the campaign vouches for."""
    for path in map(Path, files):
        if results in path.parents and CHECKPOINTS not in path.parts:
            yield path


def _place(path: Path, results: Path) -> Path:
    return results / FOLDER / f"{path.relative_to(results)}.sha256"


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
