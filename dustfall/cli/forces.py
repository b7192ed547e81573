"""`dustfall forces`: the forces on fixed spheres."""

import sys

SUMMARY = "forces on fixed spheres in a uniform Stokes flow, each with an estimate of its error"

DESCRIPTION = """\
in:  x, y, z [d_p]: the centres of the spheres
out: the same, force_x, force_y, force_z [Re_p c_D], and error_estimate, of a force over that on
     an isolated sphere"""

EXAMPLES = """\
  dustfall forces centres.csv
  dustfall forces centres.csv -o forces.csv --flow 0 0 -1 --tolerance 1e-6
  dustfall forces centres.npy -o forces.h5 --method elements"""


def add_arguments(parser) -> None:
    """Declare the arguments."""
    parser.add_argument("centres", help="table of centres")
    parser.add_argument("-o", "--output", help="table to write; default: csv on standard output")
    parser.add_argument(
        "--flow", nargs=3, type=float, default=(0.0, 1.0, 0.0), metavar=("X", "Y", "Z"),
        help="direction of the flow far away; default: 0 1 0",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=float, default=1e-4,
        help="of a force, relative to an isolated sphere's; default: 1e-4",
    )  # fmt: skip
    parser.add_argument(
        "--method", default="multipole",
        help="multipole (default), elements or paper: boundary elements need the extra mesh",
    )  # fmt: skip


def run(options) -> None:
    """Read, solve, write.

    Raises RuntimeError where the iteration does not converge: then nothing is written.
    """
    from dustfall.stokes import Status, fixed_spheres
    from dustfall.tables import Quantity, check_suffix, read_table, write_table

    if options.output:
        check_suffix(options.output)
    centre = {"centre": Quantity((3,), "d_p", "centres of the spheres")}
    centres = read_table(options.centres, centre)["centre"]
    solution = fixed_spheres(centres, options.flow, options.tolerance, options.method)
    told = (
        f"smallest gap {solution.minimum_gap:.1e} d_p, residual {solution.residual:.1e} after "
        f"{solution.iterations} iterations"
    )
    if solution.status == Status.NOT_CONVERGED:
        raise RuntimeError(f"the forces are not found: {told}")
    quantities = {
        **centre,
        "force": Quantity((3,), "Re_p c_D", "force on a sphere"),
        "error_estimate": Quantity((), "1", "of a force, over that on an isolated sphere"),
    }
    values = {
        "centre": centres,
        "force": solution.force,
        "error_estimate": solution.error_estimate,
    }
    write_table(options.output, quantities, values)
    print(
        f"{len(centres)} spheres, {solution.status}: largest error estimate "
        f"{solution.error_estimate.max():.1e}, {told}",
        file=sys.stderr,
    )
