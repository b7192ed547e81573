"""The look of all figures, and how they are saved."""

import functools
from collections.abc import Callable, Iterable, Sequence

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from dustfall.files import atomic
from dustfall.forces import registry
from dustfall.forces.formulas import FORMULAS
from dustfall.sedimentation.closures.names import ALL_PARTICLES, BACK_FLOW

STYLE: dict = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "axes.linewidth": 0.6,
    "axes.formatter.use_mathtext": True,
    "axes.axisbelow": True,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "lines.linewidth": 1.1,
    "lines.markersize": 4,
    "legend.frameon": False,
    "legend.handlelength": 1.8,
    "figure.dpi": 100,
    "savefig.dpi": 200,
    # TrueType letters stay text in the PDF, for search and for the journals' checks.
    "pdf.fonttype": 42,
}

SINGLE = 3.5
"""Width of a one-column figure [inch]."""

DOUBLE = 7.0
"""Width of a two-column figure [inch]."""

COMPONENT_COLOURS = {
    "streamwise": "#117733",
    "spanwise": "#332288",
    "vertical": "#cc6677",
    "lateral": "#882255",
}
"""Of Paul Tol's muted set, which the colour-blind can tell apart."""

CATEGORY_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe & Ito 2008."""

MODEL_COLOURS = (*CATEGORY_COLOURS, "#332288", "#882255", "#999933")
"""Of force models: there are more of them than of other things; the last three of Paul Tol."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X")

REFERENCE = "0.35"
"""Grey of reference lines and of other people's points."""

FEW_DECADES = 30.0
"""Ratio of the ends of a logarithmic axis below which it may hold less than two powers of ten."""

PHI_RANGE = (1e-8, 1e-3)
"""Volume fractions at the ends of the colour scale: the same phi has one colour in all figures."""


def styled(draw: Callable) -> Callable:
    """Let a figure function draw under the common style, whatever the caller's settings."""

    @functools.wraps(draw)
    def drawn(*arguments, **settings):
        with mpl.rc_context(STYLE):
            return draw(*arguments, **settings)

    return drawn


def new_figure(width: float, height: float) -> Figure:
    """A figure with constrained layout, outside of pyplot and its global state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


CLOSURES = {
    ALL_PARTICLES: ("all particles together", {"color": "black", "marker": MARKERS[-1]}),
    BACK_FLOW: ("nearest neighbours and back-flow", {"color": "#aa4499", "marker": "h"}),
}
"""Title and look of what stands in place of a force model where a closure is compared."""


def model_title(model: str) -> str:
    """What a force model is called in a figure: its title, without one its name as it is."""
    if model in CLOSURES:
        return CLOSURES[model][0]
    return registry.title(model) if model in registry.FORCE_MODELS else model


def model_look(model: str) -> dict:
    """Colour and marker of a force model, the same in all figures.

    Closed formulas and the models that a campaign trains come first, with a colour for each; more
    models than colours have other markers. A name that the registry lacks is drawn in grey.
    """
    first = [*FORMULAS, *registry.trained_models()]
    known = first + [name for name in registry.FORCE_MODELS if name not in first]
    if model in CLOSURES:
        return CLOSURES[model][1]
    if model not in known:
        return {"color": REFERENCE, "marker": MARKERS[0]}
    number = known.index(model)
    colours = len(MODEL_COLOURS)
    return {
        "color": MODEL_COLOURS[number % colours],
        "marker": MARKERS[(number + number // colours) % len(MARKERS)],
    }


def number_label(particles: int) -> str:
    """Number of particles, with thin spaces between thousands."""
    return f"$n = {int(particles):,}$".replace(",", r"\,")


def mark_bounds(ax, x, y, relations, along="y", length=14) -> None:
    """Draw an arrow of `length` [point] from each bound: towards more for ">=", less for "<="."""
    for place, value, relation in zip(x, y, relations, strict=True):
        if relation in (">=", "<="):
            reach = length if relation == ">=" else -length
            ax.annotate(
                "",
                (place, value),
                (0, reach) if along == "y" else (reach, 0),
                textcoords="offset points",
                # The head is at the text, which is empty.
                arrowprops={"arrowstyle": "<-", "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
            )


def log_scale(ax, axes: str) -> None:
    """Make axes ("x", "y" or "xy") logarithmic, numbered in whole powers of ten.

    An axis of less than `FEW_DECADES` is numbered 1, 2, 3, 5, ... instead, in plain numbers from
    0.001 to 5000 and with a power of ten beyond.
    """
    for name in axes:
        getattr(ax, f"set_{name}scale")("log")
        axis = getattr(ax, f"{name}axis")
        axis.set_major_formatter(FuncFormatter(functools.partial(_log_label, axis, False)))
        axis.set_minor_formatter(FuncFormatter(functools.partial(_log_label, axis, True)))


def _log_label(axis, minor, value, _) -> str:
    low, high = axis.get_view_interval()
    mantissa, exponent = f"{value:.0e}".split("e")
    power = f"10^{{{int(exponent)}}}"
    if high / low >= FEW_DECADES:
        return f"${power}$" if mantissa == "1" and not minor else ""
    if mantissa not in ("1", "2", "3", "5"):
        return ""
    return f"{value:g}" if 1e-3 <= value < 1e4 else f"${mantissa}\\times {power}$"


def phi_colour(volume_fraction: float):
    """Colour of a volume fraction, from pale (dilute) to dark (dense)."""
    low, high = np.log10(PHI_RANGE)
    place = np.clip((np.log10(volume_fraction) - low) / (high - low), 0, 1)
    return mpl.colormaps["viridis_r"](0.08 + 0.92 * place)


def phi_label(volume_fraction: float) -> str:
    """Volume fraction as a power of ten, with its factor where it is not a whole power."""
    exponent = int(np.floor(np.log10(volume_fraction) + 1e-9))
    factor = volume_fraction / 10.0**exponent
    if abs(factor - 1) < 1e-6:
        return f"$10^{{{exponent}}}$"
    return f"${factor:.3g}\\times 10^{{{exponent}}}$"


def phi_legend(figure: Figure, volume_fractions: Iterable[float]) -> None:
    """Put one legend with the colours of the volume fractions above the panels."""
    phi = sorted(set(volume_fractions))
    handles = [Line2D([], [], color=phi_colour(p), lw=2.5, label=phi_label(p)) for p in phi]
    figure.legend(
        handles=handles,
        title=r"volume fraction $\varphi$",
        loc="outside upper center",
        ncols=len(phi),
        columnspacing=1.2,
        handlelength=1.2,
    )


def letter(axes: Iterable) -> None:
    """Name panels (a), (b), … above their upper left corners."""
    for i, ax in enumerate(axes):
        ax.set_title(f"({chr(ord('a') + i)})", loc="left")


def require(frame: pd.DataFrame, columns: Sequence[str], figure: str, fewest: int = 1) -> None:
    """Raise ValueError where a table lacks a column or has too few rows for a figure."""
    missing = [column for column in columns if column not in frame]
    if missing:
        raise ValueError(
            f"the table of {figure} lacks the column {missing[0]!r}; it has {list(frame.columns)}"
        )
    if len(frame) < fewest:
        raise ValueError(f"the table of {figure} has {len(frame)} rows; at least {fewest} needed")


def require_components(frame: pd.DataFrame, components: Iterable[str], figure: str) -> None:
    """Raise ValueError where a table has no rows of one of the force components."""
    for component in components:
        if not (frame["component"] == component).any():
            raise ValueError(f"the table of {figure} has no rows of component {component!r}")


def save(figure: Figure, frame: pd.DataFrame, stem) -> None:
    """Write `stem`.png (200 dpi), .pdf and .csv, each atomically and with the same bytes each time.

    The CSV holds `frame`, the numbers drawn, with digits enough to read back the same bits. Dates
    and program versions stay out of the pictures' metadata.
    """
    stem = str(stem)
    with mpl.rc_context(STYLE):
        with atomic(f"{stem}.png") as path:
            figure.savefig(path, metadata={"Software": None})
        with atomic(f"{stem}.pdf") as path:
            metadata = {"CreationDate": None, "Creator": None, "Producer": None}
            figure.savefig(path, metadata=metadata)
    with atomic(f"{stem}.csv") as path:
        frame.to_csv(path, index=False)
