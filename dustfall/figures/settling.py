"""Figures of the settling cloud: settling velocity, single particles, trajectories."""

import numpy as np
import pandas as pd
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from dustfall.analysis.settling import STEADY
from dustfall.figures.fluctuations import ENERGY, WAVENUMBER
from dustfall.figures.style import (
    DOUBLE,
    MARKERS,
    REFERENCE,
    SINGLE,
    letter,
    log_scale,
    mark_bounds,
    model_look,
    model_title,
    new_figure,
    number_label,
    phi_colour,
    phi_label,
    phi_legend,
    require,
    styled,
)

PARTICLE_COLOURS = ("#d55e00", "#009e73", "#0072b2")
"""The paper's red, green and blue, in the set that the colour-blind can tell apart."""

SIDE_VIEW = 3.6
"""Height over width of a side view of paths."""

OBLIQUE = (0.45, 0.035)
"""How far depth is drawn to the right, in sides of the box, and up, in its height."""

ADAPTED = 10.0
"""Time [tau] after which the start at rest is forgotten (exp(-10) of it is left)."""

WINDOWS = ("as the paper", "until steady")
"""How long runs last: as many response times as the paper's, or as many spreading times as it
takes."""

ROOM = 0.06
"""Share of an axis that is left free beyond the numbers drawn."""

VISIBLE = 0.01
"""Share of an axis that an arrow must span to be drawn: a shorter one is less than its head."""

ASH_WIDTH = 10**0.25
"""Half the width of the band of volcanic ash, as a factor of phi: its source says "about"."""


@styled
def inverse_beta(frame: pd.DataFrame) -> Figure:
    """Settling velocity against volume fraction: for each n, and for each force model.

    `frame`: source, model, n, volume_fraction, value, low, high, status, drift, relation, as
    `analysis.settling.inverse_beta_table` gives. Left the model with most cases, beside what others
    have; right the models at the smallest n that all of them ran with. Filled with their interval:
    steady cases; hollow: at the end of runs that are not steady, with an arrow along their drift
    over the averaging window. Raises ValueError for a missing column or a table without
    simulations.
    """
    columns = ["source", "model", "n", "volume_fraction", "value", "low", "high", "status", "drift"]
    require(frame, [*columns, "relation"], "inverse_beta")
    simulation = frame[frame["source"] == "simulation"]
    if simulation.empty:
        raise ValueError("the table of inverse_beta has no rows of source 'simulation'")
    figure = new_figure(DOUBLE, 3.9)
    left, right = figure.subplots(1, 2, sharey=True)
    shown = frame[frame["source"] != "Del Bello 2017"]
    low, high = shown[["value", "low"]].min(axis=None), shown[["value", "high"]].max(axis=None)
    room = ROOM * (high - low) or ROOM
    # The legend of all models lies above the curves where they are low.
    right.set_ylim(low - room, high + 5 * room)
    principal = simulation["model"].value_counts().index[0]
    for i, (n, rows) in enumerate(simulation[simulation["model"] == principal].groupby("n")):
        look = model_look(principal) | {"marker": MARKERS[i % len(MARKERS)]}
        _settling_curve(left, rows, look, number_label(n), i)
    compared = _models_at_one_number(simulation, principal)
    for i, (model, rows) in enumerate(compared):
        _settling_curve(right, rows, model_look(model), model_title(model), i)
    _random_start(left, frame, principal)
    _paper(left, frame)
    _batchelor(left, frame)
    _batchelor(right, frame)
    _ash(right, frame)
    for ax in (left, right):
        log_scale(ax, "x")
        ax.set_xlabel(r"volume fraction $\varphi$")
        handles, labels = ax.get_legend_handles_labels()
        ours = [isinstance(handle, ErrorbarContainer) for handle in handles]
        order = np.argsort(np.logical_not(ours), kind="stable")
        ax.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper left")
    left.set_title(f"(a) {model_title(principal)}", loc="left")
    right.set_title(f"(b) models compared, {number_label(compared[0][1]['n'].iloc[0])}", loc="left")
    left.set_ylabel(r"$\langle v_s\rangle / v_{s,\mathrm{Stokes}} = 1/\beta$")
    if (simulation["status"] != STEADY).any():
        note = "filled: steady, 95 % interval; hollow: not steady, end of the run, arrow: its drift"
        figure.legend(handles=[], title=note, loc="outside lower center", title_fontsize=8)
    return figure


def _settling_curve(ax, rows, look, label, i):
    """One curve with its intervals; markers of later curves are larger, so that none is hidden."""
    rows = rows.sort_values("volume_fraction")
    size = 4 + 1.5 * i
    ax.errorbar(
        rows["volume_fraction"],
        rows["value"],
        yerr=np.nan_to_num([rows["value"] - rows["low"], rows["high"] - rows["value"]]),
        color=look["color"],
        marker=look["marker"],
        mfc="white",
        ms=size,
        lw=0.9,
        elinewidth=0.9,
        capsize=2.5,
        label=label,
        zorder=4 - 0.3 * i,
    )
    steady = rows["status"] == STEADY
    filled = rows[steady]
    # Matplotlib puts the markers of error bars 0.1 above these.
    above = 4.15 - 0.3 * i
    ax.plot(filled["volume_fraction"], filled["value"], ls="none", ms=size, zorder=above, **look)
    seen = rows["drift"].abs() > VISIBLE * np.ptp(ax.get_ylim())
    for row in rows[~steady & seen].itertuples():
        ax.annotate(
            "",
            (row.volume_fraction, row.value),
            (row.volume_fraction, row.value - row.drift),
            arrowprops={"arrowstyle": "->", "color": look["color"], "lw": 0.8, "shrinkB": 0},
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


def _paper(ax, frame):
    paper = frame[frame["source"] == "paper"]
    place, value = paper["volume_fraction"], paper["value"]
    ax.plot(
        place,
        value,
        ls="none",
        marker="*",
        ms=8,
        color="k",
        label="paper (arrow: a bound)",
        zorder=5,
    )
    mark_bounds(ax, place, value, paper["relation"])


def _random_start(ax, frame, model):
    """1/beta of the random start, of the largest cloud of each volume fraction."""
    rows = frame[(frame["source"] == "random start") & (frame["model"] == model)]
    rows = rows.sort_values("n").drop_duplicates("volume_fraction", keep="last")
    rows = rows.sort_values("volume_fraction")
    label = r"random start, mean of $1/\beta$"
    ax.plot(rows["volume_fraction"], rows["value"], color=REFERENCE, ls="--", label=label)


def _batchelor(ax, frame):
    rows = frame[frame["source"] == "Batchelor 1972"].sort_values("volume_fraction")
    label = r"infinite suspension, $1 - 6.55\,\varphi$"
    ax.plot(rows["volume_fraction"], rows["value"], color=REFERENCE, ls=":", label=label)


def _ash(ax, frame):
    """Range of what others state of volcanic ash; the axis does not follow it."""
    for row in frame[frame["source"] == "Del Bello 2017"].itertuples():
        ax.fill_between(
            [row.volume_fraction / ASH_WIDTH, row.volume_fraction * ASH_WIDTH],
            row.low,
            row.high,
            color="0.88",
            lw=0,
            zorder=0,
            label=f"volcanic ash, {row.low:g} to {row.high:g} (Del Bello et al. 2017)",
        )


@styled
def settling_in_time(frame: pd.DataFrame) -> Figure:
    """Mean over particles of the settling velocity in time, its later change, and the variance.

    `frame`: model, n, volume_fraction, time, spreading_times, mean, variance, as
    `analysis.settling.settling_in_time` gives for one model, and window ("as the paper" or "until
    steady"); one column of panels for each window and n, the first in response times, the second
    in spreading times. The change is that of the mean since `ADAPTED`, in a shorter run since half
    of it. Raises ValueError for a missing column, several models or fewer than two rows.
    """
    columns = ["model", "n", "volume_fraction", "time", "spreading_times", "mean", "variance"]
    require(frame, [*columns, "window"], "settling_in_time", fewest=2)
    if frame["model"].nunique() > 1:
        raise ValueError(
            f"settling_in_time draws one model, not {frame['model'].unique().tolist()}"
        )
    panels = sorted(frame.groupby(["window", "n"]), key=lambda panel: panel[0])
    figure = new_figure(DOUBLE if len(panels) > 1 else 1.3 * SINGLE, 6.0)
    axes = figure.subplots(3, len(panels), squeeze=False, sharex="col", sharey="row")
    for column, ((window, n), cases) in enumerate(panels):
        mean, change, variance = axes[:, column]
        paper = window == WINDOWS[0]
        clock = "time" if paper else "spreading_times"
        for phi, rows in cases.groupby("volume_fraction"):
            rows = rows.sort_values("time")
            colour = phi_colour(phi)
            mean.plot(rows[clock], rows["mean"], color=colour, lw=1)
            # Before that particles still follow their start and not the cloud.
            later = rows[rows["time"] >= min(ADAPTED, rows["time"].max() / 2)]
            gained = 100 * (later["mean"] / later["mean"].iloc[0] - 1)
            change.plot(later[clock], gained, color=colour, lw=1)
            # It has no variance either, and a logarithmic axis no zero.
            positive = rows["variance"].where(rows["variance"] > 0)
            variance.plot(rows[clock], positive, color=colour, lw=1)
        mean.axhline(1, color=REFERENCE, lw=0.6, zorder=0)
        change.axhline(0, color=REFERENCE, lw=0.6, zorder=0)
        mean.set_title(f"{number_label(n)}, {window}", fontsize=7, loc="right")
        log_scale(variance, "y")
        variance.set_xlabel(r"time $t/\tau$" if paper else "time [spreading times]")
    positive = frame["variance"][frame["variance"] > 0]
    if not positive.empty:
        axes[2, 0].set_ylim(0.5 * positive.quantile(0.01), 2 * positive.max())
    axes[0, 0].set_ylabel(r"mean $\langle v_s\rangle^{p} / v_{s,\mathrm{Stokes}}$")
    axes[1, 0].set_ylabel(f"change of the mean\nsince ${ADAPTED:g}\\,\\tau$ [%]")
    axes[2, 0].set_ylabel(r"variance $\mathrm{var}^{p}(v_s) / v_{s,\mathrm{Stokes}}^2$")
    letter(axes[:, 0])
    phi_legend(figure, frame["volume_fraction"])
    return figure


@styled
def phase_and_spectra(frame: pd.DataFrame) -> Figure:
    """Phase diagrams of the tracked particles, a panel a volume fraction, and their spectra below.

    `frame`: panel, volume_fraction, n, particle, x, y, slope, slope_error, units, as
    `analysis.spectra.phase_and_spectra` gives for one n. Orbits are drawn about the mean of each,
    at their panel's own scale, so that dilute ones show as well. Dashed: fitted power laws; the
    slope written in a panel is that of the densest case. Raises ValueError for a missing column,
    several n or fewer than two rows.
    """
    columns = ["panel", "volume_fraction", "n", "particle", "x", "y", "slope", "slope_error"]
    require(frame, [*columns, "units"], "phase_and_spectra", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"phase_and_spectra draws one n, not {frame['n'].unique().tolist()}")
    phis, particles = sorted(frame["volume_fraction"].unique()), sorted(frame["particle"].unique())
    wide = min(3, len(phis))
    high = -(-len(phis) // wide)
    figure = new_figure(DOUBLE, 0.8 + 2.0 * (high + 1))
    above, below = figure.subfigures(2, 1, squeeze=False, height_ratios=[high, 1.15]).ravel()
    orbits = above.subplots(high, wide, squeeze=False).ravel()
    for ax, phi in zip(orbits, phis, strict=False):
        _orbits(ax, frame[(frame["panel"] == "phase") & (frame["volume_fraction"] == phi)])
        ax.set_title(f"$\\varphi = ${phi_label(phi)}", loc="right")
    for ax in orbits[len(phis) :]:
        ax.set_visible(False)
    for ax in orbits[: len(phis)][-wide:]:
        ax.set_xlabel(r"$(v_s - \overline{v_s}) / v_{s,\mathrm{Stokes}}$")
    for ax in orbits[::wide]:
        ax.set_ylabel(r"$F_d / (F_g - F_b) - 1$")
    spectra = below.subplots(1, len(particles), squeeze=False, sharex=True, sharey=True)[0]
    for ax, particle in zip(spectra, particles, strict=True):
        _spectra(ax, frame[(frame["panel"] != "phase") & (frame["particle"] == particle)])
        ax.set_title(f"particle {particle}", loc="right")
        ax.set_xlabel(WAVENUMBER[frame["units"].iloc[0]])
    spectra[0].set_ylabel(ENERGY[frame["units"].iloc[0]])
    letter([*orbits[: len(phis)], *spectra])
    _particle_legend(above, frame)
    phi_legend(below, phis)
    return figure


def _orbits(ax, frame):
    for i, (_, rows) in enumerate(frame.groupby("particle")):
        colour = PARTICLE_COLOURS[i % len(PARTICLE_COLOURS)]
        x, y = rows["x"] - rows["x"].mean(), rows["y"] - 1
        ax.plot(x, y, color=colour, lw=0.7)
        ax.plot(x.iloc[-1:], y.iloc[-1:], color=colour, marker="o", ms=2.5)
    ax.axhline(0, color=REFERENCE, lw=0.5, zorder=0)
    ax.axvline(0, color=REFERENCE, lw=0.5, zorder=0)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(4))
    # Powers of ten stand at the ends of the axes, not in every number.
    ax.ticklabel_format(scilimits=(-2, 2))


def _spectra(ax, frame):
    for phi, rows in frame.groupby("volume_fraction"):
        spectrum, fit = (rows[rows["panel"] == panel] for panel in ("spectrum", "fit"))
        ax.plot(spectrum["x"], spectrum["y"], color=phi_colour(phi), lw=0.9)
        ax.plot(fit["x"], fit["y"], color="k", lw=0.6, ls="--", zorder=5)
    fits = frame[frame["panel"] == "fit"]
    if not fits.empty:
        densest = fits.sort_values("volume_fraction").iloc[-1]
        note = (
            f"$\\varphi = ${phi_label(densest['volume_fraction'])}: slope "
            f"${densest['slope']:.2f} \\pm {densest['slope_error']:.2f}$"
        )
        ax.text(0.04, 0.06, note, transform=ax.transAxes, fontsize=7.5)
    log_scale(ax, "xy")


@styled
def trajectories(frame: pd.DataFrame) -> Figure:
    """Paths of the tracked particles from their starts: top view above, side view below.

    `frame`: volume_fraction, n, particle, dx, dy, dz, as `analysis.settling.tracked_trajectories`
    gives for one n; one column of panels a volume fraction. Top views have true aspect, each its
    own scale. The side views share one scale, so that the paths' growing unrest shows; they are
    stretched sideways by the factor that stands beside them. Raises ValueError for a missing
    column, several n or fewer than two rows.
    """
    columns = ["volume_fraction", "n", "particle", "dx", "dy", "dz"]
    require(frame, columns, "trajectories", fewest=2)
    if frame["n"].nunique() > 1:
        raise ValueError(f"trajectories draws one n, not {frame['n'].unique().tolist()}")
    phis = sorted(frame["volume_fraction"].unique())
    figure = new_figure(DOUBLE if len(phis) > 2 else SINGLE, 5.2)
    axes = figure.subplots(2, len(phis), squeeze=False, height_ratios=[1, 3])
    reach = 1.1 * frame["dx"].abs().max() or 1.0
    low, high = 1.03 * frame["dz"].min(), max(0.0, frame["dz"].max())
    for column, phi in enumerate(phis):
        top, side = axes[:, column]
        rows = frame[frame["volume_fraction"] == phi]
        for i, (_, path) in enumerate(rows.groupby("particle")):
            colour = PARTICLE_COLOURS[i % len(PARTICLE_COLOURS)]
            top.plot(path["dx"], path["dy"], color=colour, lw=0.9)
            top.plot(path["dx"].iloc[-1:], path["dy"].iloc[-1:], color=colour, marker="o", ms=2.5)
            side.plot(path["dx"], path["dz"], color=colour, lw=1)
        top.plot(0, 0, color="k", marker="+", ms=5, mew=0.8)
        top.set_title(f"$\\varphi = ${phi_label(phi)}")
        own = 1.15 * rows[["dx", "dy"]].abs().to_numpy().max() or 1.0
        top.set_xlim(-own, own)
        top.set_ylim(-own, own)
        top.set_aspect("equal")
        side.set_xlim(-reach, reach)
        side.set_ylim(low, high)
        side.set_box_aspect(SIDE_VIEW)
        for ax in (top, side):
            ax.xaxis.set_major_locator(MaxNLocator(3, symmetric=True))
        top.yaxis.set_major_locator(MaxNLocator(3, symmetric=True))
        side.set_xlabel("$x - x_0$ [$d_p$]")
        if column:
            side.set_yticklabels([])
    stretch = (high - low) / (2 * reach) / SIDE_VIEW
    axes[0, 0].set_ylabel("top view: $y - y_0$ [$d_p$]")
    axes[1, 0].set_ylabel(f"side view, ${stretch:.2g}\\times$ sideways: $z - z_0$ [$d_p$]")
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
