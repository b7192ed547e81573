"""Sketches of the domain, of the network and of a particle's own frame, from their numbers."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch

from dustfall.analysis.sketches import on_page
from dustfall.figures.style import (
    CATEGORY_COLOURS,
    DOUBLE,
    REFERENCE,
    letter,
    new_figure,
    require,
    styled,
)
from dustfall.units import RADIUS

NEAR, OWN, FLOW = CATEGORY_COLOURS[0], CATEGORY_COLOURS[1], CATEGORY_COLOURS[2]
"""Colours of neighbours, of the reference sphere and its frame, and of the flow."""

ARROWS = {"axis": "k", "own axis": OWN, "flow": FLOW, "position": REFERENCE}

NEURONS = (1.1, 0.55, -0.55)
"""Heights of the three neurons that stand for a layer; between the last two there are more."""

STEP = 1.35
"""Distance of two layers."""


@styled
def sketches(frame: pd.DataFrame) -> Figure:
    """The scene in its flow, the network with the sizes of its layers, and the rotated frame.

    `frame`: as `analysis.sketches.sketches_table` gives it. Raises ValueError for a missing column
    or no row.
    """
    places = ["x", "y", "z", "from_x", "from_y", "from_z"]
    layers = ["block", "layer", "component", "width", "first", "neighbours"]
    require(frame, ["panel", "kind", "name", *places, *layers], "sketches")
    figure = new_figure(DOUBLE, 2.1)
    axes = figure.subplots(1, 3, width_ratios=(1.0, 1.45, 0.95))
    panels = dict(list(frame.groupby("panel")))
    _space(axes[0], panels["domain"])
    _network(axes[1], panels["network"])
    _space(axes[2], panels["frames"])
    titles = ("scene", "network", "frames")
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title)
        ax.set_aspect("equal", anchor="N")
        ax.set_axis_off()
    letter(axes)
    return figure


def _space(ax, rows):
    """Spheres and arrows in the projection, what is nearer to the reader above what is farther."""
    tips = on_page(rows[["x", "y", "z"]])
    starts = on_page(rows[["from_x", "from_y", "from_z"]])
    named = set()
    middle = tips[rows["kind"].eq("position")].sum(axis=0) / 3
    for row, tip, start in zip(rows.itertuples(), tips, starts, strict=True):
        if row.kind in ARROWS:
            _arrow(ax, row, tip, start, named, middle)
            continue
        colour = OWN if row.kind == "reference" else NEAR
        ax.add_patch(Circle(
            tip, RADIUS, facecolor=colour, edgecolor="k", lw=0.6, alpha=0.6, zorder=2 + row.x / 100,
        ))  # fmt: skip
        if isinstance(row.name, str):
            # Arrows start at the centre of the reference sphere: its name stands below.
            below = RADIUS + 0.35 if row.kind == "reference" else 0.0
            ax.text(tip[0], tip[1] - below, row.name, ha="center", va="center", zorder=3)
    points = np.concatenate([tips - RADIUS, tips + RADIUS, starts[~np.isnan(starts[:, 0])]])
    ax.set_xlim(points[:, 0].min() - 0.3, points[:, 0].max() + 0.3)
    ax.set_ylim(points[:, 1].min() - 0.3, points[:, 1].max() + 0.3)


def _arrow(ax, row, tip, start, named, middle):
    """An arrow with its name, once, beyond its tip; a position's outside of their triangle."""
    position = row.kind == "position"
    look = {"arrowstyle": "-|>", "color": ARROWS[row.kind], "shrinkA": 0, "mutation_scale": 8}
    # A position ends at a centre: the line stops at the sphere's rim.
    along = (tip - start) / np.linalg.norm(tip - start)
    look |= {"shrinkB": 0, "lw": 0.7 if position else 1.1, "ls": "--" if position else "-"}
    end = tip - RADIUS * along if position else tip
    ax.annotate("", end, start, arrowprops=look, zorder=1 if position else 4)
    if row.name in named:
        return
    named.add(row.name)
    across = np.array([-along[1], along[0]])
    ha = "center"
    if position:
        half = 0.5 * (tip + start)
        # Names are wider than high.
        away = 0.45 + 0.35 * abs(across[0])
        place = half + away * np.sign(across @ (half - middle)) * across
    elif row.kind == "own axis":
        # The second axis lies along the flow: names stand to the right of their arrows.
        place = tip + 0.35 * along - 0.4 * across
    else:
        place = tip + 0.35 * along
        ha = "left" if along[0] > 0.9 else "right" if along[0] < -0.6 else "center"
    ax.text(*place, row.name, color=ARROWS[row.kind], ha=ha, va="center", zorder=5)


def _network(ax, rows):
    """Blocks below each other; what a block is given to the left, what comes out to the right."""
    layers, inputs = rows[rows["kind"] == "layer"], rows[rows["kind"] == "input"]
    deepest = int(layers["layer"].max())
    right = STEP * deepest
    for block, own in layers.groupby("block"):
        y = -4.2 * block
        given = inputs[inputs["block"] == block]
        colour = NEAR if block == 0 else FLOW
        order = "2nd" if given["neighbours"].iloc[0] == 2 else "1st"
        times = "once" if len(given) == 1 else f"{len(given)} times"
        ax.add_patch(FancyBboxPatch(
            (-0.45, y - 1.25), right + 1.2, 3.2, boxstyle="round,pad=0.1", facecolor=colour,
            alpha=0.15, lw=0,
        ))  # fmt: skip
        ax.text(0.5 * right, y + 2.45, f"{order} order block, {times}", ha="center", va="center")
        last = None
        numbers = own.groupby("layer")["width"].unique()
        for layer, widths in numbers.items():
            # The output stands at the right end, however deep the block is.
            out = layer == numbers.index[-1]
            x = right if out else STEP * layer
            heights = (0.2,) if out else NEURONS
            now = [(x, y + height) for height in heights]
            for a in last or []:
                for b in now:
                    ax.plot(*zip(a, b, strict=True), color=REFERENCE, lw=0.3, zorder=1)
            for place in now:
                ax.add_patch(Circle(place, 0.24, facecolor="w", edgecolor=colour, lw=0.8, zorder=2))
            if not out:
                ax.text(x, y, r"$\vdots$", ha="center", va="center", zorder=3)
            words = " or ".join(f"{int(width)}" for width in widths)
            # The size of the last output stands below, as its arrow leads upwards.
            height = (0.75 if block == 0 else -0.35) if out else 1.65
            ax.text(x, y + height, words, ha="center", va="center", fontsize=8)
            last = now
        _inputs(ax, y, given)
    y = -4.2 * (layers["block"].nunique() - 1) / 2 + 0.2
    ax.add_patch(Circle((right + 2.4, y), 0.35, facecolor="w", edgecolor="k", lw=0.8, zorder=2))
    ax.text(right + 2.4, y, "+", ha="center", va="center", zorder=3)
    look = {"arrowstyle": "-|>", "color": "k", "lw": 0.8, "mutation_scale": 7, "shrinkA": 0}
    for block, given in inputs.groupby("block"):
        start = (right + 0.3, -4.2 * block + 0.2)
        ax.annotate("", (right + 2.4, y), start, arrowprops=look | {"shrinkB": 7})
        names = ["$F_{" + "".join(map(str, _numbers(row))) + "}$" for row in given.itertuples()]
        side = 1 if start[1] > y else -1
        ax.text(
            right + 1.25, start[1] + 0.25 * side, _listed(names), va="center"
        )  # fmt: skip
    ax.annotate("", (right + 3.7, y), (right + 2.75, y), arrowprops=look | {"shrinkB": 0})
    ax.text(right + 3.85, y, "$F$", va="center")
    ax.set_xlim(-2.6, right + 4.5)
    ax.set_ylim(-4.2 - 1.6, 2.8)


def _inputs(ax, y, given):
    """Names of the neighbours that a block is given, those of one time in one bracket."""
    names = ["$" + ",".join(f"r_{k}" for k in _numbers(row)) + "$" for row in given.itertuples()]
    ax.text(-1.0, y + 0.2, "\n".join(_few(names)), ha="right", va="center", linespacing=1.6)
    look = {"arrowstyle": "-|>", "color": "k", "lw": 0.8, "mutation_scale": 7, "shrinkA": 0}
    ax.annotate("", (-0.3, y + 0.2), (-0.9, y + 0.2), arrowprops=look | {"shrinkB": 0})


def _numbers(row) -> range:
    """Numbers, from one, of the neighbours of an input."""
    return range(int(row.first) + 1, int(row.first + row.neighbours) + 1)


def _few(names) -> list[str]:
    """At most three names: of more the first, dots and the last."""
    return names if len(names) <= 3 else [names[0], r"$\vdots$", names[-1]]


def _listed(names) -> str:
    """The same in one line."""
    return ", ".join(name.replace("vdots", "dots") for name in _few(names))
