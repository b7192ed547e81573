"""What a step of settling costs, from a thousand particles to a million."""

import resource
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pandas as pd

from dustfall.forces import load_model
from dustfall.sedimentation import AllParticles, NearestNeighbours, Properties, move, random_start
from dustfall.sedimentation.state import Closure, State

STEP = 0.1
"""Time step [tau], that of the campaign's clouds."""

UNTIMED = 2
"""First steps, which compile, choose parameters and find neighbours for the first time."""

PARTICLE_STEPS, FEWEST_STEPS, MOST_STEPS = 1_000_000, 2, 50
"""Particles times steps that are timed, and the limits of the steps."""


def settling_cost(
    numbers: Sequence[int],
    volume_fraction: float,
    threads: Sequence[int] = (1, 2),
    seed: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> pd.DataFrame:
    """Seconds of a step and memory of clouds that start at random, for each closure.

    One row a closure, number of threads and number of particles, the fewest first. Columns closure,
    threads, particles, seconds (median of the steps), steps_per_second, products (with the
    mobility, mean of the steps; for all particles alone) and memory [GiB], the most that the
    process has taken until then.
    """
    rows, jobs = [], [(n, count) for n in sorted(numbers) for count in threads]
    for done, (n, count) in enumerate(jobs, start=1):
        start = random_start(n, volume_fraction, seed, velocity="stokes")
        for closure in (
            NearestNeighbours(load_model(), threads=count),
            AllParticles(Properties(), STEP, threads=count),
        ):
            steps = int(np.clip(PARTICLE_STEPS // n, FEWEST_STEPS, MOST_STEPS))
            seconds, products = zip(*_timed(closure, start, steps), strict=True)
            taken = float(np.median(seconds))
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
            rows.append((closure.name, count, n, taken, 1 / taken, np.mean(products), memory))
        if progress is not None:
            progress(done, len(jobs))
    columns = ["closure", "threads", "particles", "seconds", "steps_per_second", "products"]
    return pd.DataFrame(rows, columns=[*columns, "memory"])


def _timed(closure: Closure, state: State, steps: int) -> Iterator[tuple[float, float]]:
    """Seconds of each step but the first ones, and its products with the mobility."""
    stokes_number = Properties().stokes_number
    for k in range(UNTIMED + steps):
        start = time.perf_counter()
        drag = closure(state)
        after = move(state, drag, STEP, stokes_number)
        seconds = time.perf_counter() - start
        if k >= UNTIMED:
            yield seconds, closure.statistics(state, drag).get("products", np.nan)
        state = after


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Power of the number of particles that the seconds of a step grow with, least squares.

    table: of `settling_cost`. One row a closure and number of threads: closure, threads, exponent.
    """
    rows = [
        (*group, np.polyfit(np.log(own["particles"]), np.log(own["seconds"]), 1)[0])
        for group, own in table.groupby(["closure", "threads"], sort=False)
    ]
    return pd.DataFrame(rows, columns=["closure", "threads", "exponent"])
