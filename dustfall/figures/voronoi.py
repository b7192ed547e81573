"""Figures of the Voronoï cells: clusters and voids."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dustfall.analysis.settling import STEADY
from dustfall.figures.style import (
    CATEGORY_COLOURS,
    MARKERS,
    REFERENCE,
    SINGLE,
    log_scale,
    mark_bounds,
    new_figure,
    number_label,
    phi_colour,
    phi_label,
    phi_legend,
    require,
    styled,
)


@styled
def voronoi_pdf(frame: pd.DataFrame) -> Figure:
    """P.d.f. of normalised Voronoï volumes at each Galileo number, the random start, gamma laws.

    `frame`: source, galileo_multiple, volume, density, low, high, as
    `analysis.voronoi.voronoi_pdf_table` gives. Raises ValueError for a missing column or fewer than
    two rows.
    """
    columns = ["source", "galileo_multiple", "volume", "density", "low", "high"]
    require(frame, columns, "voronoi_pdf", fewest=2)
    figure = new_figure(1.4 * SINGLE, 3.4)
    ax = figure.subplots()
    shown = frame[frame["density"] > 0]
    settling = shown[shown["source"] == "settling"]
    for i, (multiple, rows) in enumerate(settling.groupby("galileo_multiple")):
        colour = CATEGORY_COLOURS[i % len(CATEGORY_COLOURS)]
        ax.fill_between(rows["volume"], rows["low"], rows["high"], color=colour, alpha=0.25, lw=0)
        name = r"$\mathrm{Ga}$" if multiple == 1 else f"${multiple:g}\\,\\mathrm{{Ga}}$"
        ax.plot(rows["volume"], rows["density"], color=colour, label=f"settling, {name}")
    start = shown[shown["source"] == "random start"]
    ax.plot(
        start["volume"],
        start["density"],
        ls="none",
        marker="o",
        ms=2.8,
        mfc="none",
        mew=0.7,
        color="k",
        label="random start",
    )
    for source, line in {"gamma, k = 5, theta = 0.2": "--", "gamma, k = 5.59": ":"}.items():
        rows = frame[frame["source"] == source]
        label = source.replace("theta", r"$\theta$").replace("k =", "$k$ =")
        ax.plot(rows["volume"], rows["density"], color=REFERENCE, ls=line, label=label)
    log_scale(ax, "y")
    ax.set_ylim(1e-3, 2)
    ax.set_xlim(0, 3.5)
    ax.set_xlabel(r"cell volume $V\,/\,\overline{V}$")
    ax.set_ylabel("p.d.f.")
    ax.legend(loc="upper right")
    return figure


@styled
def voronoi_variance(frame: pd.DataFrame) -> Figure:
    """Variance of normalised Voronoï volumes against settling velocity, by volume fraction.

    `frame`: source, n, volume_fraction, status, variance, low, high, inverse_beta,
    inverse_beta_low, inverse_beta_high, relation, inverse_beta_relation, as
    `analysis.voronoi.voronoi_variance_table` gives. Filled: steady, with 95 % intervals; hollow:
    the end of runs that are not steady. Crosses: random spheres at the same phi. Raises ValueError
    for a missing column or an empty table.
    """
    columns = ["source", "n", "volume_fraction", "status", "variance", "low", "high", "relation"]
    speed = ["inverse_beta", "inverse_beta_low", "inverse_beta_high", "inverse_beta_relation"]
    require(frame, [*columns, *speed], "voronoi_variance")
    figure = new_figure(1.4 * SINGLE, 4.2)
    ax = figure.subplots()
    ours = frame[frame["source"] == "simulation"]
    numbers = sorted(ours["n"].unique())
    for row in ours.itertuples():
        size = numbers.index(row.n)
        colour = phi_colour(row.volume_fraction)
        steady = row.status == STEADY
        ax.errorbar(
            row.inverse_beta,
            row.variance,
            yerr=np.nan_to_num([[row.variance - row.low], [row.high - row.variance]]),
            xerr=np.nan_to_num(
                [
                    [row.inverse_beta - row.inverse_beta_low],
                    [row.inverse_beta_high - row.inverse_beta],
                ]
            ),
            color=colour,
            marker=MARKERS[size % len(MARKERS)],
            mfc=colour if steady else "white",
            mec="white" if steady else colour,
            mew=0.5 if steady else 1,
            ms=6,
            elinewidth=0.8,
            capsize=2,
            ls="none",
            # The largest cloud, which knows best, on top.
            zorder=3 + 0.1 * size,
        )
    for row in frame[frame["source"] == "random spheres"].itertuples():
        ax.errorbar(
            row.inverse_beta,
            row.variance,
            yerr=[[row.variance - row.low], [row.high - row.variance]],
            color=phi_colour(row.volume_fraction),
            marker="x",
            ms=5,
            elinewidth=0.8,
            ls="none",
            zorder=4,
        )
    points = frame[frame["source"] == "random points"].sort_values("inverse_beta")
    ax.plot(points["inverse_beta"], points["variance"], color=REFERENCE, lw=0.8, ls="--", zorder=0)
    paper = frame[frame["source"] == "paper"]
    ax.plot(paper["inverse_beta"], paper["variance"], ls="none", marker="*", ms=8, color="k")
    place = paper["inverse_beta"], paper["variance"]
    mark_bounds(ax, *place, paper["relation"])
    mark_bounds(ax, *place, paper["inverse_beta_relation"], along="x")
    for row in paper.itertuples():
        ax.annotate(
            phi_label(row.volume_fraction),
            (row.inverse_beta, row.variance),
            (-5, 4),
            textcoords="offset points",
            ha="right",
            fontsize=7,
        )
    ax.set_xlabel(r"settling velocity $\langle v_s\rangle / v_{s,\mathrm{Stokes}} = 1/\beta$")
    ax.set_ylabel(r"$\mathrm{var}(V\,/\,\overline{V}) \;/\; (k\theta^2)$")
    handles = [
        Line2D(
            [], [], color="k", ls="none", marker=MARKERS[i % len(MARKERS)], label=number_label(n)
        )
        for i, n in enumerate(numbers)
    ]
    if (ours["status"] != STEADY).any():
        look: dict = {"marker": "o", "mfc": "white"}
        handles.append(Line2D([], [], color="k", ls="none", label="not steady: its end", **look))
    handles += [
        Line2D([], [], color="k", ls="none", marker="x", label="random spheres"),
        Line2D([], [], color=REFERENCE, lw=0.8, ls="--", label="random points"),
        Line2D([], [], color="k", ls="none", marker="*", ms=8, label="paper (arrow: a bound)"),
    ]
    ax.legend(handles=handles, loc="lower right")
    phi_legend(figure, ours["volume_fraction"])
    return figure
