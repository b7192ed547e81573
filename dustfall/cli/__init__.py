"""`dustfall` on the command line: a module a subcommand, which imports what it needs as it runs."""

import re
import shlex
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence

from dustfall import __version__
from dustfall.cli import export, forces, predict, settle, train, view

SUBCOMMANDS = {
    "forces": forces,
    "predict": predict,
    "settle": settle,
    "train": train,
    "export": export,
    "view": view,
}

DESCRIPTION = """\
Stokes drag among neighbours. Lengths are in particle diameters d_p, forces in Re_p c_D (an
isolated sphere feels 24 along the flow), times in the response time tau of a particle.
Tables are csv, npy or h5 by their suffix; each has its columns and units in its help."""


class Parser(ArgumentParser):
    """A parser that says what is wrong in one sentence."""

    def __init__(self, **options):
        super().__init__(allow_abbrev=False, formatter_class=RawDescriptionHelpFormatter, **options)
        # -1e-3 is a number too; before Python 3.14 the parser takes it for an option.
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message):
        """End with status 2."""
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> Parser:
    """The parser of all subcommands."""
    whole = Parser(prog="dustfall", description=DESCRIPTION)
    whole.add_argument("--version", action="version", version=f"dustfall {__version__}")
    subparsers = whole.add_subparsers(required=True, metavar="COMMAND", dest="subcommand")
    for name, module in SUBCOMMANDS.items():
        subparser = subparsers.add_parser(
            name,
            help=module.SUMMARY,
            description=f"{module.SUMMARY[0].upper()}{module.SUMMARY[1:]}.\n\n{module.DESCRIPTION}",
            epilog=f"examples:\n{module.EXAMPLES}",
        )
        module.add_arguments(subparser)
    return whole


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; return 0, 2 after an error, or 130 where Ctrl-C or SIGTERM ended it.

    Either is told in one sentence.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    options = parser().parse_args(arguments)
    options.command = shlex.join(["dustfall", *arguments])
    try:
        SUBCOMMANDS[options.subcommand].run(options)
    except BrokenPipeError:
        sys.stderr.close()  # who read the output went away, and wants no more of it
    except KeyboardInterrupt:
        print(f"\ndustfall {options.subcommand}: interrupted", file=sys.stderr)
        return 130
    except SystemExit as stop:
        if not isinstance(stop.code, str):
            raise
        # Of a run that has saved its state.
        print(f"dustfall {options.subcommand}: {stop}", file=sys.stderr)
        return 130
    except (
        ArithmeticError, ImportError, MemoryError, OSError, RuntimeError, ValueError,
    ) as error:  # fmt: skip
        print(f"dustfall {options.subcommand}: {_sentence(error)}", file=sys.stderr)
        return 2
    return 0


def _sentence(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(str(error).split()) or type(error).__name__
