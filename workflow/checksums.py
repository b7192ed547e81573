"""Checksums of all that a campaign makes: written by the job that makes a file, checked by readers.

Beside `results/<file>` lies `results/checksums/<file>.sha256`, one line as the tool sha256sum
writes and reads it. It covers every byte of a file of any format, headers included, before a
library opens the file, and leaves tables and pictures as other programs expect them.
"""

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

RESULTS = Path("results")
FOLDER = RESULTS / "checksums"

CHECKPOINTS = "checkpoints"
"""Folder of unfinished runs, which vouch for themselves."""


class DamageError(ValueError):
    """A file of the campaign is not what its job wrote; the message says what to do."""


def seal(files: Iterable[str | Path]) -> None:
    """Write the checksum of each of the files that lies in `results/`."""
    for path in filter(_is_result, map(Path, files)):
        place = _place(path)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(f"{_digest(path)}  {path.as_posix()}\n", encoding="utf-8")


def check(files: Iterable[str | Path]) -> None:
    """Raise DamageError unless each of the files in `results/` has the bytes that its job wrote.

    What lies elsewhere is the user's own.
    """
    for path in filter(_is_result, map(Path, files)):
        complaint = _complaint(path)
        if complaint:
            raise DamageError(f"{complaint}; `snakemake verify` names all such files")


def verify() -> Iterator[tuple[Path, str]]:
    """Yield every file of `results/`, there or lost, with what is wrong about it, if anything."""
    made = {
        RESULTS / place.relative_to(FOLDER).with_suffix("")
        for place in FOLDER.rglob("*.sha256")
        if place.is_file()
    }
    there = {
        path
        for path in RESULTS.rglob("*")
        if path.is_file() and FOLDER not in path.parents and CHECKPOINTS not in path.parts
    }
    for path in sorted(made | there):
        yield path, _complaint(path)


def _complaint(path: Path) -> str:
    """What is wrong with a file of the campaign, and what to do; nothing for a whole one."""
    again = f"remove it (rm '{path}') and give the same command again, which makes it anew"
    if not path.is_file():
        return f"{path} is lost; the same command given again makes it anew"
    try:
        line = _place(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        return f"{path} has no checksum in {FOLDER}, so no job of this campaign made it: {again}"
    except UnicodeDecodeError:
        line = ""
    if line != f"{_digest(path)}  {path.as_posix()}\n":
        return f"{path} is damaged, it is not what its job wrote: {again}"
    return ""


def _is_result(path: Path) -> bool:
    return RESULTS in path.parents and CHECKPOINTS not in path.parts


def _place(path: Path) -> Path:
    return FOLDER / f"{path.relative_to(RESULTS)}.sha256"


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
