"""Read what a case of `make_settling` left: its parcels, in the order of the start."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dustfall.sedimentation import Properties
from openfoam.cases.make_settling import CLOUD


class Frame(NamedTuple):
    """Parcels at a time [s]: positions (n, 3) [d_p], velocities (n, 3) [v_s], ranks (n,)."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    rank: np.ndarray


def read_frames(case: Path, properties: Properties) -> list[Frame]:
    """All frames after the start, of a case that ran on one rank or on several."""
    folders = sorted(case.glob("processor*")) or [case]
    times = {path.name for path in folders[0].iterdir() if re.match(r"\d", path.name)}
    frames = []
    for time in sorted(times - {"0"}, key=float):
        parts = []
        for rank, folder in enumerate(folders):
            parcels = folder / time / "lagrangian" / CLOUD
            number = _numbers(parcels / "origId", 1)
            columns = (
                _numbers(parcels / "positions", 4)[:, :3] / properties.diameter,
                _numbers(parcels / "U", 3) / properties.settling_velocity,
                np.full(len(number), rank),
            )
            parts.append(np.column_stack([number, *columns]))
        table = np.concatenate(parts)
        table = table[table[:, 0].argsort()]
        frames.append(Frame(float(time), table[:, 1:4], table[:, 4:7], table[:, 7]))
    return frames


def _numbers(path: Path, columns: int) -> np.ndarray:
    """The list in a file of OpenFOAM, (n, columns)."""
    body = path.read_text().split("}", 1)[1]
    body = re.sub(r"//.*", "", body)
    uniform = re.match(r"\s*(\d+)\{(.*)\}", body)
    if uniform:
        value = [float(number) for number in uniform[2].strip("()").split()]
        return np.tile(value, (int(uniform[1]), 1))
    values = re.sub(r"[()]", " ", body.split("(", 1)[1]).split() if "(" in body else []
    return np.array(values, dtype=float).reshape(-1, columns)
