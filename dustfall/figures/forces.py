"""Figures of the data set and of the force models."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator

from dustfall.figures.style import (
    COMPONENT_COLOURS,
    DOUBLE,
    letter,
    log_scale,
    model_look,
    model_title,
    new_figure,
    phi_colour,
    phi_label,
    require,
    require_components,
    styled,
)
from dustfall.units import STOKES_DRAG

FORCE_UNIT = r"[$\mathrm{Re}_p c_D$]"

LEAST_DENSITY = 1e-3
"""Lowest density [1/(Re_p c_D)] that is drawn: of a few samples in a slice of thousands."""

DENSITY_ROOM = 6.0
"""Factor between the highest density and the top of its axis, where the notes stand."""

LINES = {"radial": "-", "azimuthal": ":", "polar": "--"} | {
    "spanwise": ":",
    "streamwise": "-",
    "vertical": "--",
}


@styled
def force_scatter(frame: pd.DataFrame) -> Figure:
    """Force components against volume fraction, one panel each; Stokes drag as a line.

    `frame`: volume_fraction, component, force, as `analysis.distributions.force_samples` gives.
    Raises ValueError for a missing column or an empty table.
    """
    require(frame, ["volume_fraction", "component", "force"], "force_scatter")
    symbols = {"spanwise": "x", "streamwise": "y", "vertical": "z"}
    require_components(frame, symbols, "force_scatter")
    figure = new_figure(DOUBLE, 2.5)
    axes = figure.subplots(1, 3)
    lateral = frame.loc[frame["component"] != "streamwise", "force"].abs().max()
    reach = 1.08 * lateral if lateral > 0 else 1.0
    for ax, component in zip(axes, symbols, strict=True):
        rows = frame[frame["component"] == component]
        colour = COMPONENT_COLOURS[component]
        ax.scatter(
            rows["volume_fraction"], rows["force"], s=4, color=colour, alpha=0.55, linewidths=0
        )
        log_scale(ax, "x")
        ax.set_xlabel(r"volume fraction $\varphi$")
        ax.set_ylabel(f"{component} force $F_{symbols[component]}$ {FORCE_UNIT}")
        if component == "streamwise":
            ax.axhline(STOKES_DRAG, color="k", lw=0.9)
            ax.annotate(
                "Stokes, 24",
                (0.03, STOKES_DRAG),
                (0, 3),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                fontsize=8,
            )
            bottom = min(rows["force"].min(), STOKES_DRAG - 1)
            ax.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
            ax.set_ylim(bottom - 0.5, STOKES_DRAG + 0.09 * (STOKES_DRAG - bottom))
        else:
            ax.axhline(0, color="k", lw=0.9)
            ax.set_ylim(-reach, reach)
    letter(axes)
    return figure


@styled
def force_pdf(frame: pd.DataFrame) -> Figure:
    """P.d.f. of the force in slices of the volume fraction: streamwise left, lateral right.

    `frame`: component, slice, force, density, laplace_density, laplace_ks, laplace_ks_level, as
    `analysis.distributions.force_distributions` gives. One row of panels a slice, dilute above, all
    on one logarithmic axis of density a column. Dotted on the right: the fitted Laplace law, with
    its Kolmogorov-Smirnov distance and, in brackets, that which one fit in twenty exceeds. Raises
    ValueError for a missing column or fewer than two rows.
    """
    law = ["laplace_density", "laplace_ks", "laplace_ks_level"]
    require(frame, ["component", "slice", "force", "density", *law], "force_pdf", fewest=2)
    require_components(frame, ["streamwise", "spanwise", "vertical"], "force_pdf")
    slices = sorted(frame["slice"].unique())
    figure = new_figure(DOUBLE, 1.0 + 0.8 * len(slices))
    axes = figure.subplots(len(slices), 2, sharex="col", sharey="col", squeeze=False)
    columns = {"streamwise": ["streamwise"], "lateral": ["spanwise", "vertical"]}
    for column, (name, components) in enumerate(columns.items()):
        part = frame[frame["component"].isin(components)]
        for ax, phi in zip(axes[:, column], slices, strict=True):
            for component, line in zip(components, ("-", (0, (4, 1))), strict=False):
                curve = part[(part["slice"] == phi) & (part["component"] == component)]
                x, y, colour = curve["force"], curve["density"], COMPONENT_COLOURS[component]
                ax.plot(x, y, color=colour, ls=line, lw=0.9)
                if component == components[0]:
                    ax.fill_between(x, LEAST_DENSITY, y, color=phi_colour(phi), alpha=0.4, lw=0)
                if component == "spanwise":
                    ax.plot(x, curve["laplace_density"], color="k", ls=":", lw=0.9)
            log_scale(ax, "y")
            ax.yaxis.set_major_locator(LogLocator(numticks=4))
            note = rf"$\varphi = ${phi_label(phi)}"
            if name == "lateral":
                found, expected = curve[["laplace_ks", "laplace_ks_level"]].iloc[0]
                note = f"KS {found:.2g} ({expected:.2g})"
            ax.text(0.02, 0.8, note, transform=ax.transAxes, fontsize=8)
        seen = part.loc[part["density"] >= LEAST_DENSITY, "force"]
        margin = 0.02 * np.ptp(seen)
        ax.set_xlim(seen.min() - margin, seen.max() + margin)
        ax.set_ylim(LEAST_DENSITY, DENSITY_ROOM * part["density"].max())
        ax.set_xlabel(f"{name} force {FORCE_UNIT}")
    for ax in axes[:, 0]:
        ax.set_ylabel(r"p.d.f. [$1/\mathrm{Re}_p c_D$]", fontsize=8)
        ax.axvline(STOKES_DRAG, color="k", lw=0.8, ls="--", zorder=0)
    handles = [
        Line2D([], [], color=COMPONENT_COLOURS["streamwise"], label="streamwise"),
        Line2D([], [], color=COMPONENT_COLOURS["spanwise"], label="spanwise"),
        Line2D([], [], color=COMPONENT_COLOURS["vertical"], ls=(0, (4, 1)), label="vertical"),
        Line2D([], [], color="k", ls=":", label="fitted Laplace law"),
        Line2D([], [], color="k", ls="--", lw=0.8, label="Stokes, 24"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=5)
    letter(axes[0])
    return figure


@styled
def spearman(frame: pd.DataFrame) -> Figure:
    """Spearman correlation of coordinates with forces against the number of neighbours.

    `frame`: coordinate, component, neighbours, rho, noise, as
    `analysis.correlations.spearman_by_neighbours` gives for one kind of coordinates. The grey band
    is what independent data of this size would show. Raises ValueError for a missing column, an
    empty table or several kinds of coordinates.
    """
    require(
        frame, ["coordinates", "coordinate", "component", "neighbours", "rho", "noise"], "spearman"
    )
    if frame["coordinates"].nunique() != 1:
        raise ValueError(
            f"spearman draws one kind of coordinates, not {frame['coordinates'].unique().tolist()}"
        )
    names = frame["coordinate"].unique()
    figure = new_figure(DOUBLE, 3.0)
    axes = figure.subplots(1, 2)
    panels = [["streamwise"], ["spanwise", "vertical"]]
    for ax, components in zip(axes, panels, strict=True):
        for component in components:
            for name in names:
                rows = frame[(frame["component"] == component) & (frame["coordinate"] == name)]
                ax.plot(
                    rows["neighbours"],
                    rows["rho"],
                    color=COMPONENT_COLOURS[component],
                    ls=LINES[name],
                    marker="o" if component != "vertical" else "s",
                    ms=3,
                )
        ax.axhspan(0, frame["noise"].max(), color="0.85", lw=0, zorder=0)
        ax.set_ylim(0, 1.12 * frame.loc[frame["component"].isin(components), "rho"].max())
        ax.set_xticks(sorted(frame["neighbours"].unique()))
        ax.tick_params(axis="x", which="minor", length=0)
        ax.set_xlabel("number of closest neighbours")
        ax.set_ylabel(r"mean $|\rho_\mathrm{Spearman}|$")
    symbols = {"radial": "$r$", "azimuthal": r"$\phi$", "polar": r"$\theta$"}
    handles = [
        Line2D([], [], color="k", ls=LINES[name], label=f"{name} {symbols.get(name, '')}".strip())
        for name in names
    ]
    handles += [
        Line2D([], [], color=COMPONENT_COLOURS[c], marker=m, ms=3, label=f"{c} force")
        for c, m in {"streamwise": "o", "spanwise": "o", "vertical": "s"}.items()
    ]
    handles.append(Line2D([], [], color="0.85", lw=5, label="independent data"))
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
    letter(axes)
    return figure


@styled
def predicted_vs_target(frame: pd.DataFrame) -> Figure:
    """Predicted against target force of each model: streamwise above, lateral below.

    `frame`: model, component, target, predicted, r2, as
    `analysis.correlations.predictions_against_target` gives; one column of panels a model, in the
    order of the table. Raises ValueError for a missing column or an empty table.
    """
    require(frame, ["model", "component", "target", "predicted", "r2"], "predicted_vs_target")
    require_components(frame, ["streamwise", "lateral"], "predicted_vs_target")
    models = frame["model"].unique()
    figure = new_figure(min(DOUBLE, 0.6 + 2.2 * len(models)), 4.6 if len(models) < 4 else 3.6)
    axes = figure.subplots(2, len(models), squeeze=False, sharex="row", sharey="row")
    for row, component in enumerate(("streamwise", "lateral")):
        part = frame[frame["component"] == component]
        margin = 0.05 * np.ptp(part["target"]) or 1.0
        low, high = part["target"].min() - margin, part["target"].max() + margin
        for column, model in enumerate(models):
            ax = axes[row, column]
            rows = part[part["model"] == model]
            ax.plot([low, high], [low, high], color="k", lw=0.8, zorder=3)
            ax.scatter(
                rows["target"],
                rows["predicted"],
                s=4,
                color=model_look(model)["color"],
                alpha=0.5,
                linewidths=0,
            )
            ax.set_xlim(low, high)
            ax.set_ylim(low, high)
            ax.set_aspect("equal")
            for axis in (ax.xaxis, ax.yaxis):
                axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
            if not rows.empty:
                ax.text(0.05, 0.9, determination(rows["r2"].iloc[0]), transform=ax.transAxes)
            outside = ((rows["predicted"] < low) | (rows["predicted"] > high)).sum()
            if outside:
                note = f"{outside} of {len(rows)} points outside"
                ax.text(0.95, 0.05, note, transform=ax.transAxes, ha="right", fontsize=7)
            if row == 0:
                ax.set_title(model_title(model))
            ax.set_xlabel(f"target {component} force {FORCE_UNIT}")
        axes[row, 0].set_ylabel(f"predicted {FORCE_UNIT}")
    return figure


@styled
def error_by_distance(frame: pd.DataFrame) -> Figure:
    """RMS and largest error of each model against the gap to the nearest neighbour.

    `frame`: model, gap, rms_error, largest_error, as `analysis.evaluation.error_by_gap` gives. The
    line is the RMS error of a bin, the dots its largest. Raises ValueError for a missing column or
    an empty table.
    """
    require(frame, ["model", "gap", "rms_error", "largest_error"], "error_by_distance")
    figure = new_figure(DOUBLE, 3.4)
    ax = figure.subplots()
    for model, rows in frame.groupby("model", sort=False):
        colour = model_look(model)["color"]
        ax.plot(rows["gap"], rows["rms_error"], color=colour, label=model_title(model))
        ax.plot(rows["gap"], rows["largest_error"], ".", color=colour, ms=3)
    log_scale(ax, "xy")
    ax.set_xlabel("gap to the nearest neighbour [$d_p$]")
    ax.set_ylabel(f"error of the force {FORCE_UNIT}")
    figure.legend(title="line: RMS, dots: largest", loc="outside right upper")
    return figure


@styled
def learning_curve(frame: pd.DataFrame) -> Figure:
    """1 - R^2 on test scenes against the number of training scenes, a panel a component.

    `frame`: model, component, radial_law, training_scenes, r2, as the trials of the workflow give.
    Colours tell models, lines radial laws. Raises ValueError for a missing column or an empty
    table.
    """
    columns = ["model", "component", "radial_law", "training_scenes", "r2"]
    require(frame, columns, "learning_curve")
    require_components(frame, ["streamwise", "lateral"], "learning_curve")
    models, laws = frame["model"].unique(), frame["radial_law"].unique()
    looks = {model: model_look(model) for model in models}
    lines = dict(zip(laws, ("-", "--", ":"), strict=False))
    figure = new_figure(DOUBLE, 2.8)
    axes = figure.subplots(1, 2)
    for ax, component in zip(axes, ("streamwise", "lateral"), strict=True):
        for (model, law), rows in frame[frame["component"] == component].groupby(
            ["model", "radial_law"], sort=False
        ):
            rows = rows.sort_values("training_scenes")
            ax.plot(
                rows["training_scenes"],
                1 - rows["r2"],
                lines[law],
                ms=3,
                **looks[model],
            )
        log_scale(ax, "xy")
        ax.set_xlabel("training scenes")
        ax.set_ylabel(f"$1 - R^2$, {component}")
    handles = [Line2D([], [], ms=3, label=model_title(m), **looks[m]) for m in models]
    handles += [Line2D([], [], color="k", ls=lines[law], label=f"law {law}") for law in laws]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))
    letter(axes)
    return figure


@styled
def accuracy_vs_cost(frame: pd.DataFrame) -> Figure:
    """1 - R^2 of each model against the processor time of a prediction, a panel a component.

    `frame`: model, component, r2, microseconds. Raises ValueError for a missing column or an empty
    table.
    """
    require(frame, ["model", "component", "r2", "microseconds"], "accuracy_vs_cost")
    require_components(frame, ["streamwise", "lateral"], "accuracy_vs_cost")
    figure = new_figure(DOUBLE, 3.2)
    axes = figure.subplots(1, 2)
    for ax, component in zip(axes, ("streamwise", "lateral"), strict=True):
        models = frame[frame["component"] == component].groupby("model", sort=False)
        for model, rows in models:
            look = {"ls": "none", "label": model_title(model)} | model_look(model)
            ax.plot(rows["microseconds"], 1 - rows["r2"], **look)
        log_scale(ax, "xy")
        ax.margins(0.1)
        ax.set_xlabel(r"processor time [$\mu$s a particle]")
        ax.set_ylabel(f"$1 - R^2$, {component}")
    letter(axes)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5)
    return figure


def determination(r2: float) -> str:
    """R^2 with as many digits as tell it from one."""
    digits = 3 if r2 >= 1 or r2 < 0.99 else int(np.ceil(-np.log10(1 - r2))) + 1
    # Minus zero is zero.
    return f"$R^2 = {round(r2, min(digits, 7)) + 0.0:.{min(digits, 7)}f}$"
