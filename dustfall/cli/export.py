"""`dustfall export`: models and trajectories in files for other programs."""

from pathlib import Path

from dustfall.cli import models

SUMMARY = "write a force model or a trajectory for other programs"

DESCRIPTION = """\
models:       openfoam   a dictionary for the plugin
              json       the same for C++, C and Fortran
              onnx       the networks alone (extra onnx)
trajectories: vtkhdf     ParaView 5.12 and later, VTK
              xdmf       the same with a file .xdmf beside it, which ParaView 5.11 opens too
              amber      NetCDF-3 in angstrom and picoseconds: MDAnalysis, VMD, OVITO"""

EXAMPLES = """\
  dustfall export model.safetensors --to openfoam -o constant/forceModel
  dustfall export anchored --to json -o anchored.json
  dustfall export run.nc --to vtkhdf -o run.vtkhdf --positions unwrapped --units si"""

MODELS = ("openfoam", "json", "onnx")
TRAJECTORIES = ("vtkhdf", "xdmf", "amber")


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
        help="of vtkhdf and xdmf: d_p, tau, v_s as in the run (default), or m, s, m/s",
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
    if options.to == "onnx":
        if isinstance(model, Formula):
            raise ValueError(f"{model.name} has no networks that ONNX could hold")
        export_onnx(model, options.output)
        return
    export = export_openfoam if options.to == "openfoam" else export_json
    export(model, options.output, options.neighbours or NEIGHBOURS)


def _export_trajectory(options) -> None:
    from dustfall.progress import Progress
    from dustfall.sedimentation.export import export_vtkhdf

    with Progress("export", "frames") as progress:
        export_vtkhdf(
            options.source,
            options.output,
            options.positions != "unwrapped",
            progress=progress.report,
        )
