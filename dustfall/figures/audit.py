"""Figure of the audit: how far forces by different methods differ, and how far they may."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

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

SMALLEST = 1e-12
"""Differences below are drawn here: rounding."""


@styled
def audit(frame: pd.DataFrame) -> Figure:
    """Difference of the force against the sum of both error estimates, and against the gap.

    `frame`: radial_law, method, minimum_gap, difference, estimate, estimate_recorded, as
    `benchmarks.audit.audit` gives. Points above the line would disagree. Raises ValueError for a
    missing column or an empty table.
    """
    columns = ["radial_law", "method", "minimum_gap", "difference", "estimate", "estimate_recorded"]
    require(frame, columns, "audit")
    figure = new_figure(DOUBLE, 3.0)
    left, right = figure.subplots(1, 2)
    known = frame[np.isfinite(frame["difference"])]
    laws, methods = list(frame["radial_law"].unique()), list(frame["method"].unique())
    for (law, method), rows in known.groupby(["radial_law", "method"], sort=False):
        look = {
            "color": CATEGORY_COLOURS[laws.index(law) % len(CATEGORY_COLOURS)],
            "marker": MARKERS[methods.index(method) % len(MARKERS)],
            "ls": "none",
            "ms": 3,
            "mfc": "none",
            "mew": 0.7,
        }
        difference = rows["difference"].clip(lower=SMALLEST)
        allowed = rows["estimate"] + rows["estimate_recorded"]
        left.plot(allowed, difference, label=f"{law}, {method}", **look)
        right.plot(rows["minimum_gap"], difference, **look)
        right.plot(
            rows["minimum_gap"], allowed, marker="_", ls="none", ms=3, mew=0.6, color=REFERENCE,
            zorder=0,
        )  # fmt: skip
    log_scale(left, "xy")
    log_scale(right, "xy")
    low, high = left.get_xlim()
    left.plot([low, high], [low, high], color="k", lw=0.8, ls="--", zorder=0)
    left.set_xlim(low, high)
    left.set_xlabel("sum of both error estimates")
    left.set_ylabel(r"difference of the force $/\, 24$")
    right.set_xlabel("smallest gap [$d_p$]")
    right.plot([], [], marker="_", ls="none", color=REFERENCE, label="sum of both estimates")
    handles = [*left.get_legend_handles_labels()[0], right.get_lines()[-1]]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
    letter((left, right))
    return figure
