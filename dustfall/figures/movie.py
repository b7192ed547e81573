"""A short movie of the settling cloud, coloured by velocity."""

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from dustfall.extras import extra
from dustfall.figures.style import new_figure, phi_label, require, styled
from dustfall.files import atomic

SIZE = 4.8, 4.0
"""Of a picture [inch]."""

DPI = 110

COLOURS = 128
"""Of the palette, which all pictures share so that nothing flickers."""

SLAB = 0.06
"""Share of the cube, in depth, that is drawn: of the whole cloud one would see its front alone."""

PANEL = 0.75
"""Share of a picture's width that the panel takes, beside the colour bar."""

POINTS_PER_INCH = 72

EXTREMES = (0.01, 0.99)
"""Quantiles of the last frame's velocities between which the colour scale runs."""

SMALLEST = 2.2
"""Diameter of a dot at least [point]; true to scale where particles are larger."""


def save_movie(
    trajectory: xr.Dataset,
    path,
    frames: int,
    milliseconds=120,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a GIF or MP4 of a slab of the cloud, seen from a side, in the frame of its mean motion.

    Parameters
    ----------
    trajectory : coordinates [d_p] and velocities [v_s] (frame, atom, spatial), time (frame) [tau],
        cell_lengths (frame, cell_spatial) [d_p]; attributes n and volume_fraction
    path : of the movie, .gif or .mp4 (H.264), written atomically
    frames : pictures at most, evenly spaced over the run, from its first frame to its last
    milliseconds : that a picture is shown

    Raises
    ------
    ValueError : another suffix, fewer than two frames in the trajectory, or fewer than two pictures
        asked for.
    """
    write = {".gif": _write_gif, ".mp4": _write_mp4}.get(Path(path).suffix)
    if write is None:
        raise ValueError(f"{path}: a movie has the suffix .gif or .mp4")
    lacking = {"time", "coordinates", "velocities", "cell_lengths"} - set(trajectory.variables)
    if lacking:
        raise ValueError(f"there is no {', '.join(sorted(lacking))} in what is to be a trajectory")
    total = trajectory.sizes["frame"]
    if total < 2 or frames < 2:
        raise ValueError(f"{total} frames and {frames} pictures: a movie needs at least 2")
    chosen = np.unique(np.linspace(0, total - 1, min(frames, total)).round().astype(int))
    last = trajectory.isel(frame=-1)
    speed = -last["velocities"][:, 2].values
    limits = np.quantile(speed, EXTREMES)
    pictures = []
    for done, k in enumerate(chosen, start=1):
        pictures.append(_picture(cloud_slice(trajectory.isel(frame=k)), limits, trajectory.attrs))
        if progress:
            progress(done, len(chosen))
    with atomic(path) as temporary:
        write(temporary, pictures, milliseconds)


def _write_gif(path: Path, pictures: list[Image.Image], milliseconds: float) -> None:
    # The last picture has all colours of the scale; the first, at rest, has one.
    palette = pictures[-1].quantize(COLOURS)
    pictures = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    pictures[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=pictures[1:],
        duration=milliseconds,
        loop=0,
    )


def _write_mp4(path: Path, pictures: list[Image.Image], milliseconds: float) -> None:
    with extra("figures"):
        import imageio_ffmpeg
    # Colours have half the resolution: the size is a multiple of two, and need not be of more.
    writer = imageio_ffmpeg.write_frames(
        str(path), pictures[0].size, fps=1000 / milliseconds, macro_block_size=2, quality=8
    )
    writer.send(None)
    for picture in pictures:
        writer.send(picture.tobytes())
    writer.close()


def cloud_slice(frame: xr.Dataset):
    """Side view of a slab of one frame: a table of x and z [d_p], velocity [v_s], and their frame.

    Positions are relative to the mean position and folded into the cube, so that the fall of the
    whole cloud is taken out. Returns a pandas DataFrame with box_length and time as attributes.
    """
    length = float(frame["cell_lengths"][0])
    position = frame["coordinates"].values.astype(float)
    position = position - position.mean(axis=0)
    position -= length * np.floor(position / length)
    shown = position[:, 1] < SLAB * length
    table = frame["velocities"][shown].to_pandas()
    table = table.set_axis(["x", "y", "velocity"], axis=1).drop(columns="y")
    table["velocity"] *= -1
    table["x"], table["z"] = position[shown, 0], position[shown, 2]
    table.attrs = {"box_length": length, "time": float(frame["time"])}
    return table


@styled
def cloud_picture(frame, limits, volume_fraction: float, particles: int) -> Figure:
    """One picture of the movie.

    `frame`: x, z, velocity and the attributes box_length and time, as `cloud_slice` gives; `limits`
    of the colour scale [v_s]. Raises ValueError for a missing column.
    """
    require(frame, ["x", "z", "velocity"], "cloud_picture")
    length = frame.attrs["box_length"]
    figure = new_figure(*SIZE)
    ax = figure.subplots()
    diameter = max(SMALLEST, POINTS_PER_INCH * PANEL * SIZE[0] / length)
    dots = ax.scatter(
        frame["x"],
        frame["z"],
        c=frame["velocity"],
        s=diameter**2,
        lw=0,
        cmap="viridis",
        vmin=limits[0],
        vmax=limits[1],
    )
    ax.set_xlim(0, length)
    ax.set_ylim(0, length)
    ax.set_aspect("equal")
    ax.set_xlabel("$x$ [$d_p$]")
    ax.set_ylabel("$z$ [$d_p$], moving with the cloud")
    number = f"{particles:,}".replace(",", r"\,")
    ax.set_title(
        f"$n = {number}$, $\\varphi = ${phi_label(volume_fraction)}, "
        f"$t = {frame.attrs['time']:.0f}\\,\\tau$"
    )
    figure.colorbar(
        dots, ax=ax, shrink=0.93, pad=0.02, label=r"settling velocity $v_s / v_{s,\mathrm{Stokes}}$"
    )
    return figure


def _picture(table, limits, attributes) -> Image.Image:
    figure = cloud_picture(table, limits, attributes["volume_fraction"], int(attributes["n"]))
    with mpl.rc_context({"savefig.dpi": DPI}):
        figure.set_dpi(DPI)
        figure.canvas.draw()
    return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
