"""`dustfall view`: a movie of a run."""

SUMMARY = "a movie of a slab of a settling cloud, in the frame of its mean motion"

DESCRIPTION = """\
MP4 or GIF, by the suffix; colours are settling velocities. Needs the extra figures."""

EXAMPLES = """\
  dustfall view run.nc -o movie.mp4
  dustfall view run.nc -o movie.gif --pictures 30"""


def add_arguments(parser) -> None:
    """Declare the arguments."""
    parser.add_argument("trajectory", help="trajectory .nc, as `dustfall settle` writes it")
    parser.add_argument("-o", "--output", required=True, help="movie to write: .mp4 or .gif")
    parser.add_argument(
        "--pictures", type=int, default=60, help="at most; evenly spaced in time; default: 60"
    )


def run(options) -> None:
    """Draw and write."""
    from dustfall.extras import extra

    with extra("figures"):
        import xarray as xr

        from dustfall.figures.movie import save_movie
    from dustfall.progress import Progress
    from dustfall.sedimentation.trajectory import open_run

    with open_run(options.trajectory):
        pass  # a file that is missing or damaged is refused by its name
    with Progress("view", "pictures") as progress, xr.open_dataset(options.trajectory) as run:
        save_movie(run, options.output, options.pictures, progress=progress.report)
