"""Figure of meshed scenes: the elements on every sphere, coloured by the pressure on them."""

import numpy as np
import pandas as pd
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from dustfall.figures.style import DOUBLE, letter, new_figure, require, styled

VIEW = (18.0, -50.0)
"""Elevation and azimuth [degrees] from which scenes are seen."""

RIM = 0.75
"""Cosine of the angle behind the outline of a sphere up to which elements are drawn."""

COLOURS = "RdBu_r"
"""Diverging: the mean pressure of a sphere is white."""


@styled
def scene_meshes(frame: pd.DataFrame) -> Figure:
    """Scenes side by side, the elements of their spheres coloured by pressure.

    `frame`: scene, title, sphere, element, x, y, z [d_p], pressure [mu U / d_p], one row a node
    going round each element, and view_x, view_y, view_z, where the scene is seen from (zeros: from
    VIEW). All panels share their colours. Raises ValueError for a missing column or no row.
    """
    columns = ["scene", "title", "sphere", "element", "x", "y", "z", "pressure"]
    require(frame, [*columns, "view_x", "view_y", "view_z"], "scene_meshes")
    scenes = list(frame.groupby("scene", sort=False))
    figure = new_figure(DOUBLE, 2.75)
    axes = figure.subplots(1, len(scenes), subplot_kw={"projection": "3d"}, squeeze=False)[0]
    largest = frame["pressure"].abs().max()
    colours = ScalarMappable(Normalize(-largest, largest), COLOURS)
    for ax, (_, rows) in zip(axes, scenes, strict=True):
        _draw(ax, rows, colours)
        ax.set_title(rows["title"].iloc[0])
    figure.colorbar(
        colours, ax=axes, shrink=0.75, aspect=18, pad=0.01,
        label=r"pressure less its mean [$\mu U / d_p$]",
    )  # fmt: skip
    letter(axes)
    return figure


def _draw(ax, rows, colours):
    """The elements that face the eye; a sphere hides its own others."""
    counts = rows.groupby(["sphere", "element"], sort=False).size()
    nodes = rows[["x", "y", "z"]].to_numpy().reshape(len(counts), -1, 3)
    sphere = rows["sphere"].to_numpy().reshape(len(counts), -1)[:, 0]
    pressure = rows["pressure"].to_numpy().reshape(len(counts), -1)[:, 0]
    eye = rows[["view_x", "view_y", "view_z"]].iloc[0].to_numpy()
    elevation, azimuth = VIEW
    if eye.any():
        eye = eye / np.linalg.norm(eye)
        elevation = np.degrees(np.arcsin(eye[2]))
        azimuth = np.degrees(np.arctan2(eye[1], eye[0]))
    else:
        theta, phi = np.radians(VIEW)
        eye = np.array([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)])
    middle = nodes.mean(axis=1)
    centre = np.array([middle[sphere == own].mean(axis=0) for own in np.unique(sphere)])
    outward = middle - centre[np.searchsorted(np.unique(sphere), sphere)]
    # Elements at the rim are half in sight.
    seen = outward @ eye > -RIM * np.linalg.norm(outward, axis=1)
    ax.add_collection3d(
        Poly3DCollection(
            nodes[seen], facecolors=colours.to_rgba(pressure[seen]), edgecolors="0.25",
            linewidths=0.25, clip_on=False,
        )
    )  # fmt: skip
    low, high = nodes.reshape(-1, 3).min(axis=0), nodes.reshape(-1, 3).max(axis=0)
    half = 0.5 * (high - low).max()
    ax.set(**{
        f"{name}lim": (0.5 * (a + b) - half, 0.5 * (a + b) + half)
        for name, a, b in zip("xyz", low, high, strict=True)
    })  # fmt: skip
    ax.set_box_aspect((1.0, 1.0, 1.0), zoom=1.3)
    ax.set_proj_type("ortho")
    ax.view_init(elevation, azimuth)
    ax.set_axis_off()
