"""The movie shows a slab of the cloud, moving with it, in colours that mean the same throughout."""

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from dustfall.figures.movie import DPI, SIZE, SLAB, cloud_picture, cloud_slice, save_movie


def trajectory(frames=5, n=400, length=20.0):
    rng = np.random.default_rng(n)
    own = rng.normal(1.4, 0.2, n)
    time = np.arange(frames, dtype=float)
    position = rng.uniform(0, length, (n, 3)) - 90 * time[:, None, None] * [0, 0, 1]
    velocity = np.zeros((frames, n, 3))
    velocity[:, :, 2] = -own * (1 - np.exp(-time))[:, None]
    dims = ("frame", "atom", "spatial")
    return xr.Dataset(
        {
            "time": ("frame", time),
            "coordinates": (dims, position),
            "velocities": (dims, velocity),
            "cell_lengths": (("frame", "cell_spatial"), np.full((frames, 3), length)),
        },
        attrs={"n": n, "volume_fraction": 1e-3},
    )


def test_a_rigid_fall_leaves_the_picture_as_it_is():
    run = trajectory()
    first, last = (cloud_slice(run.isel(frame=k)) for k in (0, 4))
    np.testing.assert_allclose(first[["x", "z"]], last[["x", "z"]], atol=1e-9)
    assert len(first) == pytest.approx(SLAB * 400, rel=0.5)
    assert (last["velocity"] > 0).all()


def test_a_picture_shows_every_particle_of_the_slab():
    table = cloud_slice(trajectory().isel(frame=3))
    ax = cloud_picture(table, (1, 2), 1e-3, 400).axes[0]
    np.testing.assert_array_equal(ax.collections[0].get_offsets(), table[["x", "z"]])
    np.testing.assert_array_equal(ax.collections[0].get_array(), table["velocity"])
    assert "400" in ax.get_title()


def test_the_gif_has_its_pictures_and_the_same_bytes_each_time(tmp_path):
    seen = []
    save_movie(trajectory(), tmp_path / "a.gif", 3, progress=lambda *a: seen.append(a))
    save_movie(trajectory(), tmp_path / "b.gif", 3)
    with Image.open(tmp_path / "a.gif") as movie:
        assert movie.n_frames == 3
        assert movie.size == tuple(round(DPI * length) for length in SIZE)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    assert seen == [(1, 3), (2, 3), (3, 3)]


def test_the_mp4_shows_the_pictures_of_the_gif(tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    save_movie(trajectory(), tmp_path / "a.gif", 3, milliseconds=100)
    save_movie(trajectory(), tmp_path / "a.mp4", 3, milliseconds=100)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    about = next(reader)
    assert about["fps"] == 10
    with Image.open(tmp_path / "a.gif") as movie:
        assert about["size"] == movie.size
        for k, frame in enumerate(reader):
            movie.seek(k)
            shown = np.frombuffer(frame, np.uint8).reshape(*movie.size[::-1], 3)
            difference = np.asarray(movie.convert("RGB")).astype(float) - shown
            assert np.abs(difference).mean() < 4
    assert k == 2


@pytest.mark.parametrize("name", ["a.avi", "gif", "a"])
def test_a_movie_of_another_kind_is_refused(tmp_path, name):
    with pytest.raises(ValueError, match=r"suffix \.gif or \.mp4"):
        save_movie(trajectory(), tmp_path / name, 3)


def test_what_is_no_trajectory_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no cell_lengths, velocities in what"):
        save_movie(trajectory().drop_vars(["velocities", "cell_lengths"]), tmp_path / "a.gif", 3)


def test_a_single_frame_is_no_movie(tmp_path):
    with pytest.raises(ValueError, match="at least 2"):
        save_movie(trajectory(frames=1), tmp_path / "a.gif", 10)
    assert not list(tmp_path.iterdir())
