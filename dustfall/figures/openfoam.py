"""Figure of a cloud that settles in OpenFOAM and in this package."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dustfall.figures.style import CATEGORY_COLOURS, DOUBLE, letter, new_figure, require, styled


@styled
def inverse_beta_in_time(frame: pd.DataFrame) -> Figure:
    """Mean 1/beta and mean settling velocity in time: both programs left, their difference right.

    `frame`: program ("dustfall", "OpenFOAM"), time [tau], inverse_beta, velocity (over that of an
    isolated sphere), both at the same times. Raises ValueError for a missing column or fewer than
    two rows.
    """
    columns = ["program", "time", "inverse_beta", "velocity"]
    require(frame, columns, "inverse_beta_in_time", fewest=2)
    runs = {
        program: frame[frame["program"] == program].sort_values("time")
        for program in ("dustfall", "OpenFOAM")
    }
    figure = new_figure(DOUBLE, 2.8)
    left, right = figure.subplots(1, 2)
    own, other = runs.values()
    for quantity, name, colour in (
        ("inverse_beta", r"$\langle 1/\beta\rangle$", CATEGORY_COLOURS[0]),
        ("velocity", r"$\langle v_s\rangle / v_{s,\mathrm{Stokes}}$", CATEGORY_COLOURS[1]),
    ):
        for (program, rows), line in zip(runs.items(), ("-", "--"), strict=True):
            label = f"{name}, {program}"
            left.plot(rows["time"], rows[quantity], color=colour, ls=line, lw=1, label=label)
        difference = np.interp(own["time"], other["time"], other[quantity]) / own[quantity] - 1
        right.plot(own["time"], 100 * difference, color=colour, lw=1)
    left.set_ylabel(r"mean over the particles")
    right.axhline(0, color="k", lw=0.6, zorder=0)
    right.set_ylabel("OpenFOAM less dustfall [%]")
    for ax in (left, right):
        ax.set_xlabel(r"time $t/\tau$")
    figure.legend(loc="outside upper center", ncols=4)
    letter((left, right))
    return figure
