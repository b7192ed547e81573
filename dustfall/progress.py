"""Progress of long steps: a bar on a terminal, plain lines in a log file."""

import sys
import time

from dustfall.extras import extra

with extra("files"):
    from tqdm import tqdm


class Progress:
    """Reports how far a long step has come, its rate and the time that remains.

    Use as a context manager and hand `report` to the library function that does the work.
    On a terminal it draws a bar; elsewhere it prints one line every `interval` seconds.
    """

    def __init__(self, label: str, unit: str = "items", interval: float = 5.0, stream=None):
        self.label = label
        self.unit = unit
        self.interval = interval
        self.stream = stream or sys.stderr
        self.start = time.monotonic()
        self.last_line = self.start
        self.first: int | None = None
        self.bar: tqdm | None = None

    def report(self, done: int, total: int) -> None:
        """Note that `done` of `total` items are finished.

        Where the first call tells of more than one, these were done before, as in a run that goes
        on from a checkpoint: rate and time that remains are of the others.
        """
        if self.first is None:
            self.first = done if done > 1 else 0
        if self.stream.isatty():
            if self.bar is None:
                self.bar = tqdm(
                    total=total,
                    initial=self.first,
                    desc=self.label,
                    unit=self.unit,
                    file=self.stream,
                )
            self.bar.update(done - self.bar.n)
            return
        now = time.monotonic()
        if done < total and now - self.last_line < self.interval:
            return
        self.last_line = now
        rate = (done - self.first) / max(now - self.start, 1e-9)
        remaining = (total - done) / rate if rate > 0 else float("inf" if done < total else 0)
        print(
            f"{self.label}: {done} of {total} {self.unit}, {rate:.3g} a second, "
            f"{remaining:.0f} s to go",
            file=self.stream,
            flush=True,
        )

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        if self.bar is not None:
            self.bar.close()
