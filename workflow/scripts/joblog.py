"""Where a job's words go: into the log of its rule.

Every script begins here, so here is also what all jobs have in common at their beginning and end:
inputs are checked, outputs get their checksums, and a job that stops says why.
"""

import atexit
import gc
import os
import signal
import sys
import traceback
from collections.abc import Callable

from dustfall.files import remove_leftovers
from dustfall.progress import Progress
from workflow import checksums, stops

# Imports make half a million objects and no garbage: looking for it takes a tenth of their time.
gc.disable()


def start(job) -> Callable[..., Callable[[int, int], None]]:
    """Send all that this process and its libraries print from now on to the log of `job`.

    An uncaught exception goes there as well, because it is printed last. Returns a function
    `progress(label, unit)`, which makes the callback that library functions report to: it writes
    lines to the log, where what shows the whole run finds them.

    `job` is what Snakemake hands to a script. Its inputs are compared with their checksums, its
    outputs get theirs when the script has come to its end. Raises DamageError for an input that
    is not what its own job wrote.
    """
    with open(job.log[0], "w", encoding="utf-8") as file:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            os.dup2(file.fileno(), stream.fileno())
            stream.reconfigure(line_buffering=True)

    gc.enable()
    _end_with_a_sentence(job)
    for path in job.output:
        remove_leftovers(path)
    checksums.check(job.input, checksums.results_of(job.log[0]))

    return lambda label, unit="items": Progress(label, unit).report


def _end_with_a_sentence(job) -> None:
    """Seal the outputs of a job that ends well; have any other end with one sentence."""

    def seal() -> None:
        if not all(map(os.path.exists, job.output)):
            return
        try:
            checksums.seal(job.output, checksums.results_of(job.log[0]))
        except OSError as error:
            # Python would go on from here to a good end.
            stops.note(f"{job.rule}: {stops.sentence(error)}")
            os._exit(1)

    def fail(kind, error, trace) -> None:
        atexit.unregister(seal)
        words = f"{job.rule}: {stops.sentence(error)}"
        traceback.print_exception(kind, error, trace)
        stops.note(words)

    def interrupt(number, frame) -> None:
        # No exception: compiled functions would turn it into an error of their own.
        for path in job.output:
            remove_leftovers(path)
        words = f"{job.rule}: ended by {signal.Signals(number).name}"
        print(words)
        stops.note(words)
        os._exit(128 + number)

    atexit.register(seal)
    sys.excepthook = fail
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, interrupt)
