"""Figures of closures beside each other, and of how long clusters live."""

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dustfall.figures.style import (
    DOUBLE,
    REFERENCE,
    SINGLE,
    letter,
    log_scale,
    model_look,
    model_title,
    new_figure,
    phi_colour,
    phi_legend,
    require,
    styled,
)

PANELS = {
    "mean": (r"time $t/\tau$", r"mean $\langle v_s\rangle / v_{s,\mathrm{Stokes}}$", ""),
    "variance": (r"time $t/\tau$", r"variance $\mathrm{var}(v_s) / v_{s,\mathrm{Stokes}}^2$", "y"),
    "voronoi": (r"cell volume $V\,/\,\overline{V}$", "p.d.f.", "y"),
    "pairs": (r"distance $r\;[d_p]$", "pair distribution $g(r)$", "x"),
    "spectrum": (
        r"wavenumber $\kappa\;[1/d_p]$",
        r"$E(\kappa)\;[v_{s,\mathrm{Stokes}}^2\, d_p]$",
        "xy",
    ),
}
"""Labels of each panel, and which of its axes are logarithmic."""

VARIANCES = 200.0
"""Largest over smallest variance that is drawn."""

LEGEND = (0.85, 0.26)
"""Where the legend of the closures stands: in place of a sixth panel."""

LINES = ("-", "--", ":", "-.")
"""Of boxes, from the smallest on."""


@styled
def closures(frame: pd.DataFrame) -> Figure:
    """What clouds do whose closure and box differ: in time, and in their structure.

    `frame`: panel, model, n, box, x, y, low, high, as `analysis.closures.closures_table` gives. One
    colour a closure, one line style a box. Raises ValueError for a missing column or fewer than two
    rows.
    """
    columns = ["panel", "model", "n", "box", "x", "y", "low", "high"]
    require(frame, columns, "closures", fewest=2)
    figure = new_figure(DOUBLE, 5.0)
    axes = figure.subplots(2, 3).ravel()
    numbers = sorted(frame["n"].unique())
    for ax, (panel, (across, up, logarithmic)) in zip(axes, PANELS.items(), strict=False):
        for (model, n), rows in frame[frame["panel"] == panel].groupby(["model", "n"]):
            rows = rows[rows["y"] > 0] if "y" in logarithmic else rows
            line = LINES[numbers.index(n) % len(LINES)]
            colour = model_look(model)["color"]
            ax.plot(rows["x"], rows["y"], color=colour, ls=line, lw=1)
            if rows["low"].notna().any():
                ax.fill_between(
                    rows["x"], rows["low"], rows["high"], color=colour, alpha=0.15, lw=0
                )
        log_scale(ax, logarithmic)
        ax.set_xlabel(across)
        ax.set_ylabel(up)
    for ax in (axes[0], axes[3]):
        ax.axhline(1, color=REFERENCE, lw=0.6, zorder=0)
    # From rest it rises through decades within the first response times.
    largest = frame.loc[frame["panel"] == "variance", "y"].max()
    axes[1].set_ylim(largest / VARIANCES, 2 * largest)
    axes[2].set_ylim(1e-3, 2)
    axes[2].set_xlim(0, 4)
    letter(axes[: len(PANELS)])
    axes[-1].remove()
    models = sorted(frame["model"].unique())
    handles = [
        Line2D([], [], color=model_look(model)["color"], lw=2, label=model_title(model))
        for model in models
    ]
    boxes = frame.drop_duplicates("n").set_index("n")["box"]
    handles += [
        Line2D(
            [],
            [],
            color="k",
            ls=LINES[i % len(LINES)],
            label=f"$n = {n:,}$, box {boxes[n]:.3g} $d_p$".replace(",", r"\,", 1),
        )
        for i, n in enumerate(numbers)
    ]
    figure.legend(handles=handles, loc="center", bbox_to_anchor=LEGEND)
    return figure


@styled
def lifetimes(frame: pd.DataFrame) -> Figure:
    """Autocorrelation of velocity and of membership in clusters, in spreading times.

    `frame`: volume_fraction, n, quantity, spreading_times, correlation, as
    `analysis.lifetimes.lifetimes_table` gives for one n; a panel a quantity. Raises ValueError for
    a missing column, several n or fewer than two rows.
    """
    columns = ["volume_fraction", "n", "quantity", "spreading_times", "correlation"]
    require(frame, columns, "lifetimes", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"lifetimes draws one n, not {frame['n'].unique().tolist()}")
    quantities = list(dict.fromkeys(frame["quantity"]))
    figure = new_figure(2 * SINGLE, 3.2)
    axes = figure.subplots(1, len(quantities), squeeze=False, sharex=True, sharey=True)[0]
    for ax, quantity in zip(axes, quantities, strict=True):
        for phi, rows in frame[frame["quantity"] == quantity].groupby("volume_fraction"):
            ax.plot(rows["spreading_times"], rows["correlation"], color=phi_colour(phi), lw=1)
        ax.axhline(0, color=REFERENCE, lw=0.6, zorder=0)
        ax.set_title(quantity, loc="right")
        ax.set_xlabel("lag [spreading times]")
    axes[0].set_ylabel("autocorrelation over particles")
    letter(axes)
    phi_legend(figure, frame["volume_fraction"])
    return figure
