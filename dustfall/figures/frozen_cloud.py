"""Figure of the truncation to five neighbours: a frozen random cloud, seen by few and by all."""

import pandas as pd
from matplotlib.figure import Figure

from dustfall.figures.style import (
    CATEGORY_COLOURS,
    DOUBLE,
    REFERENCE,
    letter,
    log_scale,
    new_figure,
    phi_colour,
    phi_label,
    phi_legend,
    require,
    styled,
)

CLOSURE = 5
"""Neighbours of the closure."""


@styled
def frozen_cloud(frame: pd.DataFrame) -> Figure:
    """Drag against the number of neighbours, closure against all particles, settling velocity.

    `frame`: panel, source, volume_fraction, x, y, low, high, as
    `analysis.frozen_cloud.frozen_cloud_table` gives. Raises ValueError for a missing column or
    fewer than two rows.
    """
    columns = ["panel", "source", "volume_fraction", "x", "y", "low", "high"]
    require(frame, columns, "frozen_cloud", fewest=2)
    figure = new_figure(DOUBLE, 2.9)
    few, each, settling = figure.subplots(1, 3)
    panels = dict(list(frame.groupby("panel")))
    _against_number(few, panels["neighbours"])
    _particle_by_particle(each, panels["particles"], panels["correlation"])
    _against_phi(settling, panels["settling"])
    _against_phi(settling, panels["drag"], drag=True)
    settling.legend(loc="upper left", fontsize=7)
    letter([few, each, settling])
    phi_legend(figure, panels["neighbours"]["volume_fraction"])
    return figure


def _against_number(ax, frame):
    for phi, rows in frame.groupby("volume_fraction"):
        colour = phi_colour(phi)
        ax.fill_between(rows["x"], rows["low"], rows["high"], color=colour, alpha=0.3, lw=0)
        ax.plot(rows["x"], rows["y"], color=colour, marker="o", ms=2.5)
    ax.axvline(CLOSURE, color=REFERENCE, lw=0.6, ls="--", zorder=0)
    log_scale(ax, "x")
    ax.set_ylim(0, 1.04)
    ax.set_xlabel("neighbours in unbounded fluid")
    ax.set_ylabel(r"mean drag $\overline{\beta}$")


def _particle_by_particle(ax, frame, correlation):
    phi = frame["volume_fraction"].iloc[0]
    ax.plot(frame["x"], frame["y"], ls="none", marker=".", ms=2.5, color=phi_colour(phi))
    ax.axline((1, 1), slope=1, color=REFERENCE, lw=0.6, ls="--")
    ax.set_xlabel(r"drag $\beta$, five neighbours")
    ax.set_ylabel(r"drag $\beta$, all particles")
    r = correlation.loc[correlation["volume_fraction"] == phi, "y"].iloc[0]
    note = f"$\\varphi = ${phi_label(phi)}\ncorrelation {r:.2f}"
    ax.text(0.04, 0.96, note, transform=ax.transAxes, va="top", fontsize=8)


def _against_phi(ax, frame, drag=False):
    colours = {"five neighbours": CATEGORY_COLOURS[0], "all particles": CATEGORY_COLOURS[1]}
    quantity = "drag" if drag else "velocity"
    for source, rows in frame.groupby("source"):
        if source not in colours:
            label = source
            ax.plot(rows["x"], rows["y"], color=REFERENCE, ls=":", label=label, zorder=5)
            continue
        ax.errorbar(
            rows["x"],
            rows["y"],
            yerr=[rows["y"] - rows["low"], rows["high"] - rows["y"]],
            color=colours[source],
            marker="v" if drag else "o",
            mfc="none",
            ls="--" if drag else "-",
            lw=0.9,
            capsize=2,
            label=f"{quantity}, {source}",
        )
    log_scale(ax, "x")
    ax.set_xlabel(r"volume fraction $\varphi$")
    ax.set_ylabel("mean, over that of a lone sphere")
