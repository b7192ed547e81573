"""Where a job's words go: into the log of its rule, with the progress bar left on the terminal."""

import os
import sys
from collections.abc import Callable

from dustfall.progress import Progress


def start(log: str) -> Callable[..., Callable[[int, int], None]]:
    """Send all that this process and its libraries print from now on to the file `log`.

    An uncaught exception goes there as well, because it is printed last. Returns a function
    `progress(label, unit)`, which makes the callback that library functions report to: it writes
    lines to the log and, where standard error was a terminal, draws a bar there.
    """
    terminal = os.fdopen(os.dup(2), "w", buffering=1)
    with open(log, "w", encoding="utf-8") as file:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            os.dup2(file.fileno(), stream.fileno())
            stream.reconfigure(line_buffering=True)

    def progress(label: str, unit: str = "items") -> Callable[[int, int], None]:
        reports = [Progress(label, unit).report]
        if terminal.isatty():
            reports.append(Progress(label, unit, stream=terminal).report)

        def report(done: int, total: int) -> None:
            for each in reports:
                each(done, total)

        return report

    return progress
