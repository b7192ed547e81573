"""`dustfall train`: a force model from samples."""

import sys
from dataclasses import replace

SUMMARY = "train a force model on samples"

DESCRIPTION = """\
in:  x1, y1, z1, x2, ... [d_p], force_x, force_y, force_z [Re_p c_D]: neighbours and the force on
     the sphere at the origin, in the frame of the flow (x spanwise, y streamwise, z vertical), and,
     if any, weight, of a sample's squared error; in h5 neighbours (m, k, 3), force (m, 3) and
     weight (m,), as in a campaign's results/dataset/forces.h5 or what `dustfall predict` writes
out: a model, for `dustfall predict --model`, `settle --model` and `export`
One sample in ten is kept for validation; keep samples for your own test apart. The same samples
and arguments give the same bits. Needs the extra train."""

EXAMPLES = """\
  dustfall train forces.h5 -o model.safetensors
  dustfall train forces.csv -o model.safetensors --kind idnn --layers 40-40/30-30-30 --epochs 300"""

LAYERS = {"dense": "60-60-60", "pairwise": "40-40-40", "decomposed": "30-30/10"}
"""Widths by default: of the campaign's winners, about as many as 32,000 samples can teach."""

SETTINGS = ("epochs", "batch_size", "learning_rate")


def add_arguments(parser) -> None:
    """Declare the arguments."""
    parser.add_argument("samples", help="table of samples")
    parser.add_argument("-o", "--output", required=True, help="model to write, .safetensors")
    parser.add_argument("--kind", default="anchored", help="of model; default: anchored")
    parser.add_argument("--layers", help="hidden widths of each block, as in 30-30/10")
    parser.add_argument("--epochs", type=int)
    parser.add_argument("--batch-size", type=int, help="samples a step; 0: all")
    parser.add_argument("--learning-rate", type=float)
    parser.add_argument("--seed", type=int, default=1, help="default: 1")
    parser.add_argument("--device", default="cpu", help="cpu (default) or cuda")


def run(options) -> None:
    """Read, train, write."""
    from dustfall.forces.features import KINDS
    from dustfall.tables import Quantity, read_table
    from dustfall.training import SETTINGS as DEFAULTS
    from dustfall.training import train_model

    # After the training room, whose missing packages have an extra of their own.
    from dustfall.progress import Progress  # isort: skip

    if not options.output.endswith(".safetensors"):
        raise ValueError(f"{options.output}: a model has the suffix .safetensors")
    if options.kind not in KINDS:
        raise ValueError(f"kind is {options.kind!r}: allowed are {', '.join(KINDS)}")
    quantities = {
        "neighbours": Quantity((None, 3), "d_p", "neighbours as seen from the sphere"),
        "force": Quantity((3,), "Re_p c_D", "force on the sphere at the origin"),
        "weight": Quantity((), "1", "of a sample's squared error", required=False),
    }
    samples = read_table(options.samples, quantities)
    given = {name: getattr(options, name) for name in SETTINGS}
    settings = replace(
        DEFAULTS[options.kind],
        **{name: value for name, value in given.items() if value is not None},
    )
    with Progress(f"train {options.kind}", "epochs") as progress:
        model = train_model(
            options.kind,
            samples["neighbours"],
            samples["force"],
            options.layers or LAYERS[KINDS[options.kind].blocks],
            settings,
            options.seed,
            device=options.device,
            progress=progress.report,
            weight=samples.get("weight"),
        )
    model.header["training"]["command"] = options.command
    model.save(options.output)
    scores = model.header["training"]["validation"]
    told = ", ".join(f"{component} {_shown(score['r2'])}" for component, score in scores.items())
    print(f"{options.output}: R^2 of the validation samples: {told}", file=sys.stderr)


def _shown(r2: float | None) -> str:
    return "none, it is the same in all" if r2 is None else f"{r2:.6f}"
