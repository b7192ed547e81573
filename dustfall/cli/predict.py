"""`dustfall predict`: the force on a sphere among neighbours, by a force model."""

from dustfall.cli import models

SUMMARY = "force on a sphere among its neighbours, by a force model"

DESCRIPTION = """\
in:  x1, y1, z1, x2, ... [d_p]: the neighbours of the sphere of each row, as seen from it, in any
     order, in the frame of the flow: x spanwise, y streamwise, z vertical; npy: (m, k, 3)
out: the same, and force_x, force_y, force_z [Re_p c_D] on that sphere"""

EXAMPLES = """\
  dustfall predict neighbours.csv
  dustfall predict neighbours.npy --model reflections -o forces.npy
  dustfall predict neighbours.h5 --model results/model/idnn.safetensors -o forces.h5"""


def add_arguments(parser) -> None:
    """Declare the arguments."""
    parser.add_argument("neighbours", help="table of neighbours")
    parser.add_argument("-o", "--output", help="table to write; default: csv on standard output")
    parser.add_argument("--model", default="anchored", help=models.HELP)


def run(options) -> None:
    """Read, predict, write."""
    from dustfall.tables import Quantity, check_suffix, read_table, write_table

    if options.output:
        check_suffix(options.output)
    model = models.named_model(options.model)
    seen = {"neighbours": Quantity((None, 3), "d_p", "neighbours as seen from the sphere")}
    force = {"force": Quantity((3,), "Re_p c_D", "force on the sphere at the origin")}
    neighbours = read_table(options.neighbours, seen)["neighbours"]
    values = {"neighbours": neighbours, "force": model.predict(neighbours)}
    write_table(options.output, {**seen, **force}, values)
