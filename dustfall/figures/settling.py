"""Figures of the settling cloud: settling velocity, single particles, trajectories."""

import numpy as np
import pandas as pd
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from dustfall.figures.style import (
    CATEGORY_COLOURS,
    DOUBLE,
    MARKERS,
    REFERENCE,
    SINGLE,
    new_figure,
    phi_colour,
    phi_label,
    phi_legend,
    require,
    styled,
)

PARTICLE_COLOURS = ("#d55e00", "#009e73", "#0072b2")
"""The paper's red, green and blue, in the set that the colour-blind can tell apart."""

MODEL_NAMES = {
    "idnn": "IDNN",
    "anchored": "anchored IDNN",
    "dense": "dense network",
    "rotne_prager": "Rotne-Prager inverse",
    "stokes": "isolated Stokes",
}
"""What a force model is called in a legend, by its `name`."""

OBLIQUE = (0.45, 0.035)
"""How far depth is drawn to the right, in sides of the box, and up, in its height."""

ASH = "volcanic ash, up to (Del Bello et al. 2017)"


@styled
def inverse_beta(frame: pd.DataFrame) -> Figure:
    """Steady settling velocity against volume fraction: for each n, and for each force model.

    `frame`: source, model, n, volume_fraction, value, low, high, as
    `analysis.settling.inverse_beta_table` gives. Left the model with most cases, beside what others
    have; right the models at the smallest n that all of them ran with. Raises ValueError for a
    missing column or a table without simulations.
    """
    columns = ["source", "model", "n", "volume_fraction", "value", "low", "high"]
    require(frame, columns, "inverse_beta")
    simulation = frame[frame["source"] == "simulation"]
    if simulation.empty:
        raise ValueError("the table of inverse_beta has no rows of source 'simulation'")
    figure = new_figure(DOUBLE, 3.5)
    left, right = figure.subplots(1, 2)
    principal = simulation["model"].value_counts().index[0]
    numbers = simulation[simulation["model"] == principal].groupby("n")
    for i, (n, rows) in enumerate(numbers):
        _settling_curve(left, rows, i, _number(n))
    compared = _models_at_one_number(simulation, principal)
    for i, (model, rows) in enumerate(compared):
        _settling_curve(right, rows, i, MODEL_NAMES.get(model, model))

    _paper_and_random_start(left, frame)
    _batchelor(left, frame)
    _batchelor(right, frame)
    ash = frame[frame["source"] == "Del Bello 2017"]
    right.plot(
        ash["volume_fraction"], ash["value"], ls="none", marker="_", ms=9, color="k", label=ASH
    )
    right.vlines(ash["volume_fraction"], ash["low"], ash["high"], color="k", lw=0.9)
    right.set_yscale("log")
    right.yaxis.set_major_locator(FixedLocator([1, 1.5, 2, 3, 4]))
    right.yaxis.set_major_formatter("{x:g}")
    right.yaxis.set_minor_locator(NullLocator())
    for ax in (left, right):
        ax.set_xscale("log")
        ax.set_xlabel(r"volume fraction $\varphi$")
        handles, labels = ax.get_legend_handles_labels()
        ours = [isinstance(handle, ErrorbarContainer) for handle in handles]
        order = np.argsort(np.logical_not(ours), kind="stable")
        ax.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper left")
    left.set_title(MODEL_NAMES.get(principal, principal), loc="left")
    right.set_title(f"force models, {_number(compared[0][1]['n'].iloc[0])}", loc="left")
    left.set_ylabel(r"$\langle v_s\rangle / v_{s,\mathrm{Stokes}} = 1/\beta$")
    return figure


def _number(n):
    """Number of particles, with thin spaces between thousands."""
    return f"$n = {int(n):,}$".replace(",", r"\,")


def _settling_curve(ax, rows, i, label):
    """One curve with its intervals; markers of later curves are larger, so that none is hidden."""
    rows = rows.sort_values("volume_fraction")
    ax.errorbar(
        rows["volume_fraction"],
        rows["value"],
        yerr=np.nan_to_num([rows["value"] - rows["low"], rows["high"] - rows["value"]]),
        color=CATEGORY_COLOURS[i % len(CATEGORY_COLOURS)],
        marker=MARKERS[i % len(MARKERS)],
        mfc="none",
        ms=4 + 1.5 * i,
        lw=0.9,
        elinewidth=0.9,
        capsize=2.5,
        label=label,
        zorder=4 - 0.1 * i,
    )


def _models_at_one_number(simulation, principal):
    """Rows of each model, the principal one first, at the smallest n that all models have.

    Where they have none in common, the principal model's smallest counts.
    """
    models = simulation.groupby("model")
    shared = set.intersection(*(set(rows["n"]) for _, rows in models))
    if not shared:
        shared = set(simulation.loc[simulation["model"] == principal, "n"])
    rows = simulation[simulation["n"] == min(shared)]
    return sorted(rows.groupby("model"), key=lambda group: group[0] != principal)


def _paper_and_random_start(ax, frame):
    paper = frame[frame["source"] == "paper"]
    ax.plot(
        paper["volume_fraction"],
        paper["value"],
        ls="none",
        marker="*",
        ms=8,
        color="k",
        label="paper, steady state",
        zorder=5,
    )
    ranges = paper.dropna(subset=["low", "high"])
    ax.vlines(ranges["volume_fraction"], ranges["low"], ranges["high"], color="k", lw=0.9)
    rows = frame[frame["source"] == "random start"].sort_values("volume_fraction")
    label = r"random start, $\overline{1/\beta}$ (Rotne-Prager)"
    ax.plot(rows["volume_fraction"], rows["value"], color=REFERENCE, ls="--", label=label)


def _batchelor(ax, frame):
    rows = frame[frame["source"] == "Batchelor 1972"].sort_values("volume_fraction")
    label = r"infinite suspension, $1 - 6.55\,\varphi$"
    ax.plot(rows["volume_fraction"], rows["value"], color=REFERENCE, ls=":", label=label)


@styled
def settling_in_time(frame: pd.DataFrame) -> Figure:
    """Mean (solid) and variance (dashed) over particles of the settling velocity in time.

    `frame`: n, volume_fraction, time, mean, variance, as `analysis.settling.settling_in_time`
    gives for one model; one column of panels for each n. Raises ValueError for a missing column,
    several models or fewer than two rows.
    """
    columns = ["model", "n", "volume_fraction", "time", "mean", "variance"]
    require(frame, columns, "settling_in_time", fewest=2)
    if frame["model"].nunique() > 1:
        raise ValueError(
            f"settling_in_time draws one model, not {frame['model'].unique().tolist()}"
        )
    numbers = sorted(frame["n"].unique())
    figure = new_figure(DOUBLE if len(numbers) > 1 else 1.3 * SINGLE, 4.2)
    axes = figure.subplots(2, len(numbers), squeeze=False, sharex=True, sharey="row")
    for column, n in enumerate(numbers):
        upper, lower = axes[:, column]
        for phi, rows in frame[frame["n"] == n].groupby("volume_fraction"):
            rows = rows.sort_values("time")
            upper.plot(rows["time"], rows["mean"], color=phi_colour(phi), lw=1)
            # A start at rest has no variance, and a logarithmic axis no zero.
            variance = rows["variance"].where(rows["variance"] > 0)
            lower.plot(rows["time"], variance, color=phi_colour(phi), lw=1, ls=(0, (4, 1.2)))
        upper.axhline(1, color=REFERENCE, lw=0.6, zorder=0)
        upper.set_title(_number(n))
        lower.set_yscale("log")
        lower.set_xlabel(r"time $t/\tau$")
    variance = frame["variance"][frame["variance"] > 0]
    if not variance.empty:
        axes[1, 0].set_ylim(0.5 * variance.quantile(0.01), 2 * variance.max())
    axes[0, 0].set_ylabel(r"mean $\langle v_s\rangle^{p} / v_{s,\mathrm{Stokes}}$")
    axes[1, 0].set_ylabel(r"variance $\mathrm{var}^{p}(v_s) / v_{s,\mathrm{Stokes}}^2$")
    phi_legend(figure, frame["volume_fraction"])
    return figure


@styled
def phase_and_spectra(frame: pd.DataFrame) -> Figure:
    """Phase diagram (left) and energy spectrum (right) of each tracked particle, one a row.

    `frame`: panel, volume_fraction, particle, x, y, slope, slope_error, as
    `analysis.spectra.phase_and_spectra` gives for one n. The slope written in a panel is that of
    the densest case. Raises ValueError for a missing column, several n or fewer than two rows.
    """
    columns = ["panel", "volume_fraction", "n", "particle", "x", "y", "slope", "slope_error"]
    require(frame, columns, "phase_and_spectra", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"phase_and_spectra draws one n, not {frame['n'].unique().tolist()}")
    particles = sorted(frame["particle"].unique())
    figure = new_figure(DOUBLE, 0.6 + 2.1 * len(particles))
    axes = figure.subplots(len(particles), 2, squeeze=False, sharex="col", sharey="col")
    for row, particle in enumerate(particles):
        left, right = axes[row]
        part = frame[frame["particle"] == particle]
        for phi, rows in sorted(part.groupby("volume_fraction"), reverse=True):
            colour = phi_colour(phi)
            phase, spectrum, fit = (rows[rows["panel"] == p] for p in ("phase", "spectrum", "fit"))
            left.plot(phase["x"], phase["y"], color=colour, lw=0.7)
            # A dilute orbit is smaller than a line is wide: its last point shows where it is.
            left.plot(phase["x"].iloc[-1:], phase["y"].iloc[-1:], color=colour, marker="o", ms=2.5)
            right.plot(spectrum["x"], spectrum["y"], color=colour, lw=0.9)
            right.plot(fit["x"], fit["y"], color="k", lw=0.6, ls="--", zorder=5)
        fits = part[part["panel"] == "fit"]
        if not fits.empty:
            densest = fits.sort_values("volume_fraction").iloc[-1]
            note = (
                f"slope at $\\varphi = ${phi_label(densest['volume_fraction'])}: "
                f"${densest['slope']:.2f} \\pm {densest['slope_error']:.2f}$"
            )
            right.text(0.04, 0.06, note, transform=right.transAxes, fontsize=8)
        left.axhline(1, color=REFERENCE, lw=0.5, zorder=0)
        left.axvline(1, color=REFERENCE, lw=0.5, zorder=0)
        left.set_ylabel(r"$F_d / (F_g - F_b)$")
        left.set_title(f"particle {particle}", loc="left", fontsize=8, pad=3)
        right.set_xscale("log")
        right.set_yscale("log")
        right.set_ylabel(r"$E(\kappa)\;[v_{s,\mathrm{Stokes}}^2\, d_p]$")
    axes[-1, 0].set_xlabel(r"$v_s / v_{s,\mathrm{Stokes}}$")
    axes[-1, 1].set_xlabel(r"wavenumber $\kappa\;[1/d_p]$")
    phi_legend(figure, frame["volume_fraction"])
    return figure


@styled
def trajectories(frame: pd.DataFrame) -> Figure:
    """Paths of the tracked particles from their starts: side view above, top view below.

    `frame`: volume_fraction, n, particle, dx, dy, dz, as `analysis.settling.tracked_trajectories`
    gives for one n; one column of panels a volume fraction. The side views share one scale, so
    that the paths' growing unrest shows; each top view has its own. Raises ValueError for a
    missing column, several n or fewer than two rows.
    """
    columns = ["volume_fraction", "n", "particle", "dx", "dy", "dz"]
    require(frame, columns, "trajectories", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"trajectories draws one n, not {frame['n'].unique().tolist()}")
    phis = sorted(frame["volume_fraction"].unique())
    figure = new_figure(DOUBLE if len(phis) > 2 else SINGLE, 5.2)
    axes = figure.subplots(2, len(phis), squeeze=False, height_ratios=[3, 1])
    side = 1.1 * frame["dx"].abs().max() or 1.0
    for column, phi in enumerate(phis):
        above, below = axes[:, column]
        rows = frame[frame["volume_fraction"] == phi]
        for i, (_, path) in enumerate(rows.groupby("particle")):
            colour = PARTICLE_COLOURS[i % len(PARTICLE_COLOURS)]
            above.plot(path["dx"], path["dz"], color=colour, lw=1)
            below.plot(path["dx"], path["dy"], color=colour, lw=0.9)
            below.plot(path["dx"].iloc[-1:], path["dy"].iloc[-1:], color=colour, marker="o", ms=2.5)
        below.plot(0, 0, color="k", marker="+", ms=5, mew=0.8)
        above.set_title(f"$\\varphi = ${phi_label(phi)}")
        above.set_xlim(-side, side)
        above.set_ylim(1.03 * frame["dz"].min(), max(0.0, frame["dz"].max()))
        reach = 1.15 * rows[["dx", "dy"]].abs().to_numpy().max() or 1.0
        below.set_xlim(-reach, reach)
        below.set_ylim(-reach, reach)
        below.set_aspect("equal")
        for ax in (above, below):
            ax.xaxis.set_major_locator(MaxNLocator(3, symmetric=True))
        below.yaxis.set_major_locator(MaxNLocator(3, symmetric=True))
        below.set_xlabel("$x - x_0$ [$d_p$]")
        if column:
            above.set_yticklabels([])
    axes[0, 0].set_ylabel("side view: $z - z_0$ [$d_p$]")
    axes[1, 0].set_ylabel("top view: $y - y_0$ [$d_p$]")
    _particle_legend(figure, frame)
    return figure


@styled
def trajectories_3d(frame: pd.DataFrame) -> Figure:
    """Paths of the tracked particles in space, unwrapped, one panel a volume fraction.

    `frame` as for `trajectories`. Sideways scales are each panel's own and written beside it; all
    panels share the vertical one. Raises ValueError for a missing column, several n or fewer than
    two rows.
    """
    columns = ["volume_fraction", "n", "particle", "dx", "dy", "dz"]
    require(frame, columns, "trajectories_3d", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"trajectories_3d draws one n, not {frame['n'].unique().tolist()}")
    phis = sorted(frame["volume_fraction"].unique())
    figure = new_figure(DOUBLE if len(phis) > 2 else SINGLE, 4.6)
    axes = figure.subplots(1, len(phis), squeeze=False, sharey=True)[0]
    floor = 1.03 * frame["dz"].min()
    for ax, phi in zip(axes, phis, strict=True):
        rows = frame[frame["volume_fraction"] == phi]
        reach = 1.1 * rows[["dx", "dy"]].abs().to_numpy().max() or 1.0
        _box(ax, floor)
        for i, (_, path) in enumerate(rows.groupby("particle")):
            colour = PARTICLE_COLOURS[i % len(PARTICLE_COLOURS)]
            across, deep = path["dx"] / reach, path["dy"] / reach
            ax.plot(*_oblique(across, deep, path["dz"], floor), color=colour, lw=1)
            # Its shadow on the floor shows where a path goes sideways.
            shadow = _oblique(across, deep, np.full(len(path), floor), floor)
            ax.plot(*shadow, color=colour, lw=0.7, alpha=0.5)
        ax.set_title(f"$\\varphi = ${phi_label(phi)}")
        ax.set_xlabel(f"$\\pm {reach:.2g}\\,d_p$")
        ax.set_xticks([])
        ax.spines[["top", "right", "bottom"]].set_visible(False)
        ax.tick_params(right=False)
        ax.yaxis.set_major_locator(MaxNLocator(6))
        if ax is not axes[0]:
            ax.spines["left"].set_visible(False)
            ax.tick_params(left=False)
    axes[0].set_ylabel("$z - z_0$ [$d_p$]")
    _particle_legend(figure, frame)
    return figure


def _oblique(across, deep, up, floor):
    """Cabinet projection of places in [-1, 1] sideways and of heights; depth leads up and right."""
    return across + OBLIQUE[0] * deep, up - OBLIQUE[1] * floor * deep


def _box(ax, floor):
    """Edges of the space that a panel shows."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    for height in (0, floor):
        x, z = _oblique(*corners.T, np.full(5, height), floor)
        ax.plot(x, z, color="0.75", lw=0.6, zorder=0)
    for corner in corners[:4]:
        x, z = _oblique(*np.tile(corner, (2, 1)).T, np.array([0, floor]), floor)
        ax.plot(x, z, color="0.75", lw=0.6, zorder=0)


def _particle_legend(figure, frame):
    handles = [
        Line2D([], [], color=PARTICLE_COLOURS[i % len(PARTICLE_COLOURS)], label=f"particle {p}")
        for i, p in enumerate(sorted(frame["particle"].unique()))
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
