"""Figure of the benchmark: error against run time of every method, and cost against spheres."""

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


def front(milliseconds, error) -> np.ndarray:
    """Which points (m,) no other one beats in both time and error: the Pareto front, as a mask."""
    milliseconds, error = np.asarray(milliseconds), np.asarray(error)
    beaten = (milliseconds <= milliseconds[:, None]) & (error <= error[:, None])
    return beaten.sum(axis=1) == 1


@styled
def solver_benchmark(frame: pd.DataFrame, error: str = "error of the force / 24") -> Figure:
    """Error of the force against time a scene, one panel a set; the dotted line is the front.

    `frame`: set, method, setting, milliseconds, error_95, as `benchmarks.solver.time_against_error`
    gives them. `error`: what the error is called. Raises ValueError for a missing column or an
    empty table.
    """
    require(frame, ["set", "method", "setting", "milliseconds", "error_95"], "solver_benchmark")
    sets = list(frame["set"].unique())
    columns = min(3, len(sets))
    rows = -(-len(sets) // columns)
    figure = new_figure(DOUBLE, 0.9 + 2.2 * rows)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    looks = {
        method: {"color": CATEGORY_COLOURS[k % 7], "marker": MARKERS[(k + k // 7) % 7]}
        for k, method in enumerate(frame["method"].unique())
    }
    for panel, name in zip(panels, sets, strict=False):
        own = frame[frame["set"] == name]
        for method, look in looks.items():
            points = own[own["method"] == method].sort_values("milliseconds")
            panel.plot(points["milliseconds"], points["error_95"], lw=0.8, label=method, **look)
        best = own[front(own["milliseconds"], own["error_95"])].sort_values("milliseconds")
        panel.plot(best["milliseconds"], best["error_95"], color=REFERENCE, ls=":", zorder=0)
        log_scale(panel, "xy")
        panel.set_title(name, loc="right")
    for panel in panels[len(sets) :]:
        panel.set_visible(False)
    figure.supxlabel("time a scene [ms]", fontsize=9)
    figure.supylabel(f"{error}, 95 % of scenes below", fontsize=9)
    figure.legend(
        handles=panels[0].get_legend_handles_labels()[0], loc="outside upper center", ncols=3
    )
    letter(panels[: len(sets)])
    return figure
