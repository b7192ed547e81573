"""The state of a run on disk, from which it goes on to the same bits."""

import json
import os
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from dustfall.files import atomic, remove_leftovers

CURRENT = "state.npz"
PREVIOUS = "state.previous.npz"


def save(folder: Path, settings: dict, state: dict) -> None:
    """Write the arrays of `state` in full precision; the checkpoint before this one is kept.

    Each of the two files is whole or absent at any moment.
    """
    current = folder / CURRENT
    with atomic(current) as temporary:
        with open(temporary, "wb") as file:
            np.savez(file, settings=json.dumps(settings, sort_keys=True), **state)
            file.flush()
            os.fsync(file.fileno())
        if current.exists():
            os.replace(current, folder / PREVIOUS)


def load(folder: Path, settings: dict) -> list[dict]:
    """Return the states that `folder` holds, the latest first; none if no run was interrupted.

    Raises
    ------
    ValueError : a checkpoint was made with other settings.
    """
    states = []
    for path in (folder / CURRENT, folder / PREVIOUS):
        try:
            with np.load(path) as file:
                state = {name: file[name] for name in file.files}
        except (FileNotFoundError, BadZipFile, EOFError):
            continue  # the other one is whole: they are never written at the same time
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


def clear(folder: Path) -> None:
    """Remove the states, also one that was being written when a run was killed."""
    for name in (CURRENT, PREVIOUS):
        (folder / name).unlink(missing_ok=True)
    remove_leftovers(folder / CURRENT)
