"""Drag on an isolated sphere against mesh size: errors and observed order, the paper's beside."""

import numpy as np
import pandas as pd

from dustfall.analysis.references import PAPER_MESH_STUDY
from dustfall.units import STOKES_DRAG

PAPER = "paper"


def mesh_study_table(study: pd.DataFrame) -> pd.DataFrame:
    """Add relative error and observed order to a mesh study, and the paper's six points.

    Parameters: `study` with the columns scheme, nodes, share (of them on the sphere), elements,
    force and limit [Re_p c_D], the force on a perfect mesh. Returns the same columns and error =
    |force/24 - 1|, order. The order p is minus twice the slope of log|force - limit| against
    log(nodes), as h ~ nodes^(-1/2) on a surface; NaN for a scheme with fewer than three meshes,
    with an exact value, or whose deviation changes sign (as the paper's does).

    Raises ValueError for a missing column, an empty table, the reserved name "paper", nodes not
    above zero or a force that is not finite.
    """
    columns = ["scheme", "nodes", "share", "elements", "force", "limit"]
    missing = [column for column in columns if column not in study]
    if missing:
        raise ValueError(f"the mesh study lacks the column {missing[0]!r}")
    if study.empty:
        raise ValueError("the mesh study is empty")
    if (study["scheme"] == PAPER).any():
        raise ValueError(f"the scheme name {PAPER!r} is kept for the paper's points")
    if not ((study["nodes"] > 0).all() and np.isfinite(study["force"]).all()):
        raise ValueError("the mesh study needs nodes above zero and finite forces")
    study = study[columns]
    paper = PAPER_MESH_STUDY.assign(scheme=PAPER, limit=STOKES_DRAG)
    table = pd.concat([study, paper], ignore_index=True)
    table["error"] = (table["force"] / STOKES_DRAG - 1).abs()
    deviation = table["force"] - table["limit"]
    table["order"] = np.nan
    for _, rows in table.groupby("scheme"):
        values = deviation[rows.index]
        if rows["nodes"].nunique() < 3 or not ((values > 0).all() or (values < 0).all()):
            continue
        slope = np.polyfit(np.log(rows["nodes"]), np.log(values.abs()), 1)[0]
        table.loc[rows.index, "order"] = -2 * slope
    return table.sort_values(["scheme", "nodes"], ignore_index=True)
