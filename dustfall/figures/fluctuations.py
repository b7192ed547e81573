"""Figures of how the velocity of single particles changes in time."""

import pandas as pd
from matplotlib.figure import Figure

from dustfall.figures.style import (
    DOUBLE,
    REFERENCE,
    SINGLE,
    log_scale,
    new_figure,
    phi_colour,
    phi_label,
    phi_legend,
    require,
    styled,
)

METHOD_NAMES = {
    "periodogram": "plain periodogram, as in the paper",
    "welch": "Welch, Hann window",
}


WAVENUMBER = {"reduced": r"wavenumber $\kappa\;[1/d_p]$", "SI": r"wavenumber $\kappa$ [1/m]"}

ENERGY = {
    "reduced": r"$E(\kappa)\;[v_{s,\mathrm{Stokes}}^2\, d_p]$",
    "SI": r"$E(\kappa)\;[\mathrm{m}^3/\mathrm{s}^2]$",
}

FREQUENCY = {"reduced": r"frequency $f\;[1/\tau]$", "SI": r"frequency $f$ [Hz]"}

DENSITY = {
    "reduced": r"$\mathrm{PSD}(f)\;[v_{s,\mathrm{Stokes}}^2\, \tau]$",
    "SI": r"$\mathrm{PSD}(f)\;[(\mathrm{m}^2/\mathrm{s}^2)/\mathrm{Hz}]$",
}
"""Labels of spectra in each of `analysis.spectra.UNITS`."""


@styled
def cloud_spectra(frame: pd.DataFrame) -> Figure:
    """Spectra of the velocity averaged over all particles, by both methods, a column each.

    `frame`: method, panel, volume_fraction, n, x, y, slope, slope_low, slope_high, units, as
    `analysis.spectra.cloud_spectra` gives for one n. Above the density over frequency, below the
    energy over wavenumber with the fitted power laws. Raises ValueError for a missing column,
    several n or fewer than two rows.
    """
    columns = ["method", "panel", "volume_fraction", "n", "x", "y", "slope", "slope_low"]
    require(frame, [*columns, "slope_high", "units"], "cloud_spectra", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"cloud_spectra draws one n, not {frame['n'].unique().tolist()}")
    methods = [method for method in METHOD_NAMES if method in set(frame["method"])]
    units = frame["units"].iloc[0]
    figure = new_figure(DOUBLE, 5.8)
    axes = figure.subplots(2, len(methods), squeeze=False, sharex="row", sharey="row")
    for (above, below), method in zip(axes.T, methods, strict=True):
        for phi, rows in frame[frame["method"] == method].groupby("volume_fraction"):
            panels = dict(tuple(rows.groupby("panel")))
            slope, low, high = panels["fit"][["slope", "slope_low", "slope_high"]].iloc[0]
            label = f"{phi_label(phi)}: ${slope:.2f}\\,({low:.2f},\\,{high:.2f})$"
            for ax, name in ((above, "density"), (below, "spectrum")):
                ax.plot(panels[name]["x"], panels[name]["y"], color=phi_colour(phi), label=label)
            below.plot(panels["fit"]["x"], panels["fit"]["y"], color="k", lw=0.6, ls="--", zorder=5)
        log_scale(above, "xy")
        log_scale(below, "xy")
        above.set_title(METHOD_NAMES[method])
        above.set_xlabel(FREQUENCY[units])
        below.set_xlabel(WAVENUMBER[units])
        below.legend(
            title=r"$\varphi$: slope (95 % interval)",
            loc="upper center",
            bbox_to_anchor=(0.5, -0.2),
            ncols=2,
            fontsize=7.5,
            title_fontsize=8,
        )
    axes[0, 0].set_ylabel(DENSITY[units])
    axes[1, 0].set_ylabel(ENERGY[units])
    return figure


@styled
def ergodicity(frame: pd.DataFrame) -> Figure:
    """Spread over particles of their time averages, against the length of the average.

    `frame`: n, volume_fraction, window, spread, as `analysis.ergodicity.ergodicity_table` gives
    for one n. Raises ValueError for a missing column, several n or fewer than two rows.
    """
    require(frame, ["n", "volume_fraction", "window", "spread"], "ergodicity", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"ergodicity draws one n, not {frame['n'].unique().tolist()}")
    figure = new_figure(1.4 * SINGLE, 3.4)
    ax = figure.subplots()
    for phi, rows in frame.groupby("volume_fraction"):
        ax.plot(rows["window"], rows["spread"], color=phi_colour(phi), marker="o", ms=3)
    for level, meaning, place in (
        (1, "every particle keeps its own velocity", "bottom"),
        (0, "ergodic", "top"),
    ):
        ax.axhline(level, color=REFERENCE, lw=0.6, ls="--", zorder=0)
        shift = 0.015 if place == "bottom" else -0.015
        ax.text(
            0.03, level + shift, meaning, va=place, fontsize=8, transform=ax.get_yaxis_transform()
        )
    ax.set_ylim(-0.1, 1.1)
    log_scale(ax, "x")
    ax.set_xlabel(r"length $T/\tau$ of the time average")
    ax.set_ylabel(r"$\mathrm{var}^p(\overline{v_s}^{\,T}) \;/\; \mathrm{var}^p(v_s)$")
    phi_legend(figure, frame["volume_fraction"])
    return figure
