"""Work on fixed blocks of particles, by one thread or several."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

BLOCK = 4096
"""Particles a block: its arrays stay in the cache of a core, and calls cost little beside work."""


class Blocks:
    """Works through the blocks of `particles` rows with a number of threads.

    The blocks are the same for any number of threads and none sees what another one writes, so
    the bits of the results are the same as well. Compiled kernels release Python's lock; a force
    model in plain Python holds it and gains nothing from threads.

    Raises
    ------
    ValueError : `threads` is below one.
    """

    def __init__(self, particles: int, threads: int = 1):
        if threads < 1:
            raise ValueError(f"threads is {threads}: it has to be at least 1")
        self._first = range(0, particles, BLOCK)
        self._last = [*self._first[1:], particles]
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def run(self, work: Callable[[int, int], None]) -> None:
        """Call `work(first, last)` for the rows `first` to `last - 1` of every block."""
        each = map if self._pool is None else self._pool.map
        for _ in each(work, self._first, self._last):
            pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
