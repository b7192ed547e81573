"""Figure of how many neighbours a particle feels, and which number gives the paper's velocities."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dustfall.analysis.references import PAPER_NEIGHBOURS, PAPER_WINDOW
from dustfall.analysis.settling import STEADY
from dustfall.figures.style import (
    DOUBLE,
    REFERENCE,
    letter,
    log_scale,
    mark_bounds,
    new_figure,
    phi_colour,
    phi_label,
    require,
    styled,
)

NEAR_THE_PAPER = 10
"""Most neighbours that are drawn beside the paper's points: more lie far above them."""


@styled
def neighbour_numbers(frame: pd.DataFrame) -> Figure:
    """Settling velocity against the number of neighbours; its excess over the paper's on the right.

    `frame`: neighbours, volume_fraction, status, value, half, as_paper, paper, relation, as
    `analysis.neighbour_numbers.neighbour_numbers_table` gives. Steady runs are filled, others
    hollow; stars are the paper's points, at the number of neighbours that it writes of. Where a
    curve on the right crosses one, so many neighbours give the paper's velocity; dashed, averaged
    over the paper's window. Raises ValueError for a missing column or an empty table.
    """
    columns = ["neighbours", "volume_fraction", "status", "value", "half", "as_paper", "paper"]
    require(frame, [*columns, "relation"], "neighbour_numbers")
    figure = new_figure(DOUBLE, 3.3)
    left, right = figure.subplots(1, 2)
    points = frame.dropna(subset="paper").drop_duplicates("volume_fraction")
    for phi, rows in frame.groupby("volume_fraction"):
        rows = rows.sort_values("neighbours")
        _curve(left, rows, rows["value"], rows["half"])
        if (points["volume_fraction"] == phi).any():
            near = rows[rows["neighbours"] <= NEAR_THE_PAPER]
            excess = near["paper"] - 1
            _curve(right, near, (near["value"] - 1) / excess, near["half"] / excess)
            early = (near["as_paper"] - 1) / excess
            right.plot(near["neighbours"], early, color=phi_colour(phi), lw=0.9, ls="--")
    place = np.full(len(points), PAPER_NEIGHBOURS)
    left.plot(place, points["paper"], ls="none", marker="*", ms=8, color="k", zorder=5)
    mark_bounds(left, place, points["paper"], points["relation"])
    right.axhline(1, color=REFERENCE, lw=0.8, ls=":", zorder=0)
    log_scale(left, "x")
    left.set_ylabel(r"$\langle v_s\rangle / v_{s,\mathrm{Stokes}} = 1/\beta$")
    right.set_ylabel(r"$(1/\beta - 1)$ over that of the paper")
    right.set_xticks(range(1, NEAR_THE_PAPER + 1))
    right.tick_params(axis="x", which="minor", length=0)
    for ax in (left, right):
        ax.set_xlabel("number of nearest neighbours")
    handles = [
        Line2D([], [], color=phi_colour(phi), marker="o", label=rf"$\varphi = ${phi_label(phi)}")
        for phi in sorted(frame["volume_fraction"].unique(), reverse=True)
    ]
    handles.append(Line2D([], [], color="k", ls="none", marker="*", ms=8, label="paper"))
    if frame["as_paper"].notna().any():
        label = rf"${PAPER_WINDOW[0]:.0f}$ to ${PAPER_WINDOW[1]:.0f}\,\tau$"
        handles.append(Line2D([], [], color="k", lw=0.9, ls="--", label=label))
    if (frame["status"] != STEADY).any():
        handles.append(
            Line2D([], [], color="k", ls="none", marker="o", mfc="white", label="not steady")
        )
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    letter((left, right))
    return figure


def _curve(ax, rows, value, half):
    colour = phi_colour(rows["volume_fraction"].iloc[0])
    look = {"color": colour, "marker": "o", "mfc": "white", "capsize": 2.5, "elinewidth": 0.9}
    ax.errorbar(rows["neighbours"], value, yerr=half, lw=0.9, zorder=3, **look)
    steady = rows["status"] == STEADY
    # Matplotlib puts the markers of error bars 0.1 above these.
    ax.plot(
        rows["neighbours"][steady], value[steady], ls="none", marker="o", color=colour, zorder=3.2
    )
