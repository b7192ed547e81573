"""The state of a run on disk, from which it goes on to the same bits."""

import hashlib
import json
import os
from io import BytesIO
from pathlib import Path

import numpy as np

from dustfall.files import atomic, remove_leftovers

CURRENT = "state.bin"
PREVIOUS = "state.previous.bin"


def save(folder: Path, settings: dict, state: dict) -> None:
    """Write the arrays of `state` in full precision; the checkpoint before this one is kept.

    Each of the two files is whole or absent at any moment: a line with the SHA-256 of what follows,
    and numpy's archive of the arrays.
    """
    current, content = folder / CURRENT, BytesIO()
    np.savez(content, settings=json.dumps(settings, sort_keys=True), **state)
    with atomic(current) as temporary:
        with open(temporary, "wb") as file:
            file.write(_seal(content.getbuffer()))
            file.write(content.getbuffer())
            file.flush()
            os.fsync(file.fileno())
        if current.exists():
            os.replace(current, folder / PREVIOUS)


def load(folder: Path, settings: dict) -> list[dict]:
    """Return the states that `folder` holds, the latest first; none if no run was interrupted.

    A file that is damaged or something else counts as none, and is told: the other one is whole, as
    they are never written at the same time.

    Raises
    ------
    ValueError : a checkpoint was made with other settings.
    """
    states = []
    for path in (folder / CURRENT, folder / PREVIOUS):
        if not path.is_file():
            continue
        with open(path, "rb") as file:
            seal, content = file.readline(len(_seal(b""))), file.read()
        if seal != _seal(content):
            print(f"{path} is damaged or no checkpoint; the run goes on from before it")
            continue
        with np.load(BytesIO(content)) as file:
            state = {name: file[name] for name in file.files}
        theirs = json.loads(str(state.pop("settings")))
        differing = [
            f"{name} is {settings.get(name)!r}, there {theirs.get(name)!r}"
            for name in sorted(theirs.keys() | settings.keys())
            if theirs.get(name) != settings.get(name)
        ]
        if differing:
            raise ValueError(
                f"checkpoint {path} is of a run with other settings: {'; '.join(differing)}. "
                f"Remove the folder to start anew, or restore the settings to go on"
            )
        states.append(state)
    return states


def any_state(folder: Path) -> bool:
    """Whether `folder` holds a state that a run would go on from, be it damaged."""
    return any((folder / name).is_file() for name in (CURRENT, PREVIOUS))


def clear(folder: Path) -> None:
    """Remove the states, also one that was being written when a run was killed."""
    for name in (CURRENT, PREVIOUS):
        (folder / name).unlink(missing_ok=True)
    remove_leftovers(folder / CURRENT)


def _seal(content) -> bytes:
    return f"{hashlib.sha256(content).hexdigest()}\n".encode()
