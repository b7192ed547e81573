"""Audit of force records: a sample of the scenes solved anew by methods that share no kernel."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from dustfall.scenes import LAWS
from dustfall.solution import Status
from dustfall.stokes.methods import fixed_spheres
from dustfall.streams import Purpose, stream
from dustfall.units import STOKES_DRAG

TOLERANCE = 1e-4
"""Tolerance of the audit's own solves, unless the campaign's is larger: what meshes of 48 to 80
elements a sphere reach in milliseconds. The estimates say what it is worth in each scene."""


def audit_sample(radial_law: str, volume_fraction, number: int, seed: int) -> np.ndarray:
    """Indices of `number` scenes of a law, or of all if they are fewer, alike from every decade.

    volume_fraction: (m,). Scenes are drawn at random within each decade of the volume fraction, and
    the decades take turns until they are used up. Returns the indices in ascending order.
    """
    decade = np.floor(np.log10(volume_fraction)).astype(int)
    turns = []
    for own in np.unique(decade):
        drawn = stream(Purpose.AUDIT, seed, LAWS.index(radial_law), -own).permutation(
            np.flatnonzero(decade == own)
        )
        turns += [(turn, own, index) for turn, index in enumerate(drawn)]
    return np.sort([index for _, _, index in sorted(turns)[:number]]).astype(int)


def audit(
    radial_law: str,
    scenes: Mapping[str, np.ndarray],
    records: Mapping[str, np.ndarray],
    methods: Sequence[str],
    tolerance: float,
    progress=None,
) -> pd.DataFrame:
    """Solve scenes anew and set the forces beside those on record.

    scenes: neighbours (m, k, 3) [d_p], volume_fraction (m,), scene (m,). records: force (m, k + 1,
    3) [Re_p c_D], error_estimate (m, k + 1), status (m,). methods: keys of `fixed_spheres`.
    Returns one row for each scene and method: radial_law, scene, volume_fraction, minimum_gap,
    method, status, recorded (status on record), difference: of the force, largest of all spheres,
    over 24; estimate, estimate_recorded: of the same sphere; excess: largest difference over both
    estimates, at most 1 where the methods agree, nan where one of them found no force.
    """
    rows = []
    for k, neighbours in enumerate(scenes["neighbours"]):
        centres = np.concatenate([np.zeros((1, 3)), neighbours])
        for method in methods:
            solution = fixed_spheres(centres, tolerance=tolerance, method=method)
            difference = np.linalg.norm(solution.force - records["force"][k], axis=1) / STOKES_DRAG
            allowed = solution.error_estimate + records["error_estimate"][k]
            worst = int(np.argmax(difference / allowed))
            known = Status.NOT_CONVERGED not in (solution.status, records["status"][k])
            rows.append(
                {
                    "radial_law": radial_law,
                    "scene": int(scenes["scene"][k]),
                    "volume_fraction": scenes["volume_fraction"][k],
                    "minimum_gap": solution.minimum_gap,
                    "method": method,
                    "status": str(solution.status),
                    "recorded": str(records["status"][k]),
                    "difference": difference[worst],
                    "estimate": solution.error_estimate[worst],
                    "estimate_recorded": records["error_estimate"][k][worst],
                    "excess": difference[worst] / allowed[worst] if known else np.nan,
                }
            )
        if progress is not None:
            progress(k + 1, len(scenes["neighbours"]))
    return pd.DataFrame(rows)


def require_agreement(table: pd.DataFrame) -> None:
    """Raise RuntimeError if a force differs by more than both estimates allow."""
    wrong = table[table["excess"] > 1.0]
    if len(wrong):
        worst = wrong.loc[wrong["excess"].idxmax()]
        raise RuntimeError(
            f"scene {worst['scene']} of radial law {worst['radial_law']}: the force by "
            f"{worst['method']} differs by {worst['difference']:.1e} from that on record, and the "
            f"estimates allow {worst['estimate'] + worst['estimate_recorded']:.1e}; "
            f"{len(wrong)} of {len(table)} comparisons disagree"
        )
