"""Figures of the Voronoï cells: clusters and voids."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dustfall.figures.style import (
    CATEGORY_COLOURS,
    MARKERS,
    REFERENCE,
    SINGLE,
    new_figure,
    phi_colour,
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
    steady = shown[shown["source"] == "steady state"]
    for i, (multiple, rows) in enumerate(steady.groupby("galileo_multiple")):
        colour = CATEGORY_COLOURS[i % len(CATEGORY_COLOURS)]
        ax.fill_between(rows["volume"], rows["low"], rows["high"], color=colour, alpha=0.25, lw=0)
        name = r"$\mathrm{Ga}$" if multiple == 1 else f"${multiple:g}\\,\\mathrm{{Ga}}$"
        ax.plot(rows["volume"], rows["density"], color=colour, label=f"steady state, {name}")
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
    ax.set_yscale("log")
    ax.set_ylim(1e-3, 2)
    ax.set_xlim(0, 3.5)
    ax.set_xlabel(r"cell volume $V\,/\,\overline{V}$")
    ax.set_ylabel("p.d.f.")
    ax.legend(loc="upper right")
    return figure


@styled
def voronoi_variance(frame: pd.DataFrame) -> Figure:
    """Variance of normalised Voronoï volumes against settling velocity, by volume fraction.

    `frame`: source, n, volume_fraction, galileo, variance, low, high, inverse_beta,
    inverse_beta_low, inverse_beta_high, as `analysis.voronoi.voronoi_variance_table` gives.
    Hollow: random spheres at the same phi. Raises ValueError for a missing column or an empty
    table.
    """
    columns = ["source", "n", "volume_fraction", "variance", "low", "high"]
    speed = ["inverse_beta", "inverse_beta_low", "inverse_beta_high"]
    require(frame, [*columns, *speed], "voronoi_variance")
    figure = new_figure(1.4 * SINGLE, 3.5)
    ax = figure.subplots()
    ours = frame[frame["source"] == "steady state"]
    numbers = sorted(ours["n"].unique())
    for row in ours.itertuples():
        size = numbers.index(row.n)
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
            color=phi_colour(row.volume_fraction),
            marker=MARKERS[size % len(MARKERS)],
            mec="white",
            mew=0.5,
            ms=6,
            elinewidth=0.8,
            capsize=2,
            ls="none",
            # The largest cloud, which knows best, on top.
            zorder=3 + 0.1 * size,
        )
    spheres = frame[frame["source"] == "random spheres"]
    for row in spheres.itertuples():
        ax.errorbar(
            row.inverse_beta,
            row.variance,
            yerr=[[row.variance - row.low], [row.high - row.variance]],
            color=phi_colour(row.volume_fraction),
            marker="o",
            mfc="white",
            ms=4,
            elinewidth=0.8,
            ls="none",
            zorder=4,
        )
    points = frame[frame["source"] == "random points"].sort_values("inverse_beta")
    ax.plot(points["inverse_beta"], points["variance"], color=REFERENCE, lw=0.8, ls="--", zorder=0)
    paper = frame[frame["source"] == "paper"]
    ax.plot(paper["inverse_beta"], paper["variance"], ls="none", marker="*", ms=8, color="k")
    ax.set_xlabel(r"settling velocity $\langle v_s\rangle / v_{s,\mathrm{Stokes}} = 1/\beta$")
    ax.set_ylabel(r"$\mathrm{var}(V\,/\,\overline{V}) \;/\; (k\theta^2)$")
    handles = [
        Line2D(
            [],
            [],
            color="k",
            ls="none",
            marker=MARKERS[i % len(MARKERS)],
            label=f"$n = {int(n):,}$".replace(",", r"\,"),
        )
        for i, n in enumerate(numbers)
    ]
    handles += [
        Line2D([], [], color="k", ls="none", marker="*", ms=8, label="paper"),
        Line2D([], [], color="k", ls="none", marker="o", mfc="none", label="random spheres"),
        Line2D([], [], color=REFERENCE, lw=0.8, ls="--", label="random points"),
    ]
    ax.legend(handles=handles, loc="upper left")
    phi_legend(figure, ours["volume_fraction"])
    return figure
