"""Figure of the mesh study."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dustfall.analysis.mesh_study import PAPER
from dustfall.figures.style import (
    CATEGORY_COLOURS,
    DOUBLE,
    MARKERS,
    REFERENCE,
    letter,
    log_scale,
    new_figure,
    require,
    styled,
)
from dustfall.units import STOKES_DRAG


@styled
def mesh_study(frame: pd.DataFrame) -> Figure:
    """Drag on an isolated sphere against nodes: force left, relative error and order right.

    `frame`: scheme, nodes, share, force, error, order, as `analysis.mesh_study.mesh_study_table`
    gives, the paper's points among them. Left, the share of the nodes on the sphere stands at the
    points of meshes with an outer sphere. Raises ValueError for a missing column or an empty table.
    """
    require(frame, ["scheme", "nodes", "share", "force", "error", "order"], "mesh_study")
    figure = new_figure(DOUBLE, 3.4)
    left, right = figure.subplots(1, 2)
    schemes = [s for s in frame["scheme"].unique() if s != PAPER]
    looks: dict[str, dict] = {
        s: {"color": CATEGORY_COLOURS[i % len(CATEGORY_COLOURS)], "marker": MARKERS[i % 7]}
        for i, s in enumerate(schemes)
    }
    looks[PAPER] = {"color": REFERENCE, "marker": "*", "ms": 6, "ls": ":"}
    for scheme, look in looks.items():
        rows = frame[frame["scheme"] == scheme].sort_values("nodes")
        if rows.empty:
            continue
        left.plot(rows["nodes"], rows["force"], **look)
        for row in rows[rows["share"] < 1].itertuples():
            place = {"xytext": (6, -3), "ha": "left"} if scheme == PAPER else {"xytext": (0, -11)}
            left.annotate(
                f"{100 * row.share:.0f} %",
                (row.nodes, row.force),
                **{"ha": "center", "textcoords": "offset points"} | place,
                fontsize=7,
                color=look["color"],
            )
        order = rows["order"].iloc[0]
        name = "paper (sphere and outer sphere)" if scheme == PAPER else scheme
        label = name if np.isnan(order) else f"{name}, order {order:.1f}"
        shown = rows[rows["error"] > 0]
        right.plot(shown["nodes"], shown["error"], label=label, **look)
    exact = left.axhline(STOKES_DRAG, color="k", lw=0.8, ls="--", zorder=0, label="exact, 24")
    log_scale(left, "x")
    left.set_xlabel("number of nodes")
    left.set_ylabel(r"force on an isolated sphere [$\mathrm{Re}_p c_D$]")
    left.set_ylim(frame["force"].min() - 1, max(frame["force"].max(), STOKES_DRAG) + 1.2)
    log_scale(right, "xy")
    right.set_xlabel("number of nodes")
    right.set_ylabel(r"relative error $|F/24 - 1|$")
    left.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    handles = [*right.get_legend_handles_labels()[0], exact]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    letter((left, right))
    return figure
