"""`dustfall export`: models and trajectories in files for other programs."""

from pathlib import Path

from dustfall.cli import models

SUMMARY = "write a force model or a trajectory for other programs"

DESCRIPTION = """\
models:       openfoam   a dictionary for the plugin
              json       the same for C++, C and Fortran
              onnx       the networks alone (extra onnx)
trajectories: vtkhdf     ParaView 5.12 and later, VTK
              pvd        any ParaView; a folder of files beside it, one a frame
              amber      NetCDF-3 in angstrom and picoseconds: MDAnalysis, OVITO
The trajectories of `dustfall settle` themselves open in OVITO and xarray."""

EXAMPLES = """\
  dustfall export model.safetensors --to openfoam -o constant/forceModel
  dustfall export anchored --to json -o anchored.json
  dustfall export run.nc --to vtkhdf -o run.vtkhdf --positions unwrapped --units si"""

MODELS = ("openfoam", "json", "onnx")
TRAJECTORIES = ("vtkhdf", "pvd", "amber")


def add_arguments(parser) -> None:
    """Declare the arguments."""
    parser.add_argument("source", help=f"a trajectory .nc, or a model: {models.HELP}")
    parser.add_argument("--to", required=True, choices=(*MODELS, *TRAJECTORIES), help="format")
    parser.add_argument("-o", "--output", required=True, help="file to write")
    parser.add_argument("--neighbours", type=int, help="of a closed formula; default: 5")
    parser.add_argument(
        "--positions", choices=("folded", "unwrapped"),
        help="folded into the cube (default), or as the particles went",
    )  # fmt: skip
    parser.add_argument(
        "--units", choices=("run", "si"),
        help="of vtkhdf and pvd: d_p, tau, v_s as in the run (default), or m, s, m/s",
    )  # fmt: skip


def run(options) -> None:
    """Read, write. Raises ValueError for options that are of the other kind of source."""
    of_models = options.to in MODELS
    if of_models == (Path(options.source).suffix == ".nc"):
        formats = TRAJECTORIES if of_models else MODELS
        raise ValueError(f"{options.source} is written as {', '.join(formats)}")
    for name in ("positions", "units") if of_models else ("neighbours",):
        if getattr(options, name) is not None:
            raise ValueError(f"--{name} means nothing to the format {options.to}")
    (_export_model if of_models else _export_trajectory)(options)


def _export_model(options) -> None:
    from dustfall.forces import Formula
    from dustfall.forces.export import export_json, export_onnx, export_openfoam
    from dustfall.units import NEIGHBOURS

    model = models.named_model(options.source)
    if not isinstance(model, Formula) and options.neighbours not in (None, model.neighbours):
        raise ValueError(f"{options.neighbours} neighbours: the model takes {model.neighbours}")
    if options.to == "onnx":
        if isinstance(model, Formula):
            raise ValueError(f"{model.name} has no networks that ONNX could hold")
        export_onnx(model, options.output)
        return
    export = export_openfoam if options.to == "openfoam" else export_json
    number = NEIGHBOURS if options.neighbours is None else options.neighbours
    export(model, options.output, number)


def _export_trajectory(options) -> None:
    from dustfall.progress import Progress
    from dustfall.sedimentation.export import export_amber, export_pvd, export_vtkhdf

    folded = options.positions != "unwrapped"
    with Progress(f"export {options.source}", "frames") as progress:
        if options.to == "amber":
            if options.units is not None:
                raise ValueError("--units means nothing to amber, which has units of its own")
            export_amber(options.source, options.output, folded, progress.report)
        else:
            export = export_vtkhdf if options.to == "vtkhdf" else export_pvd
            export(options.source, options.output, folded, options.units == "si", progress.report)
