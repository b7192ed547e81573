"""Spheres that move: error estimates held against errors, and what a cloud of them costs.

`python -m dustfall.benchmarks.moving_estimates` prints all.
"""

import time

import numpy as np
import pandas as pd

from dustfall.benchmarks.solver import random_cloud
from dustfall.stokes.moving import mobility, needed_memory, resistance
from dustfall.stokes.references.fundamental_solutions import reference_loads
from dustfall.streams import Purpose, stream
from dustfall.units import RADIUS

SMALLEST_GAP = 0.02
"""Between spheres of a sampled cluster [d_p]."""

RADII = (0.15, 1.0)
"""Range of the radii of every other cluster [d_p], log-uniform; the others' are equal."""

FINE = 1e-7
"""Tolerance of the solve that stands for the truth; its own estimate is added to each error."""

OUTPUTS = {
    resistance: {"force": 1, "torque": 2, "stresslet": 2},
    mobility: {"velocity": 0, "angular_velocity": -1, "stresslet": 2},
}
"""What a problem is asked for, and the power of the diameter that makes it a velocity."""

JUDGE = 0.3
"""Error of the independent reference, over the tolerance of the solution that it judges."""

NUMBERS = (2, 3, 4, 6, 10, 20)
"""Of spheres of a sampled cluster."""

KNOWN_NUMBERS = (2, 3, 4, 6, 10)
"""Of clusters whose loads fundamental solutions know to 1e-3 in a minute or two, if at all; those
of 20 spheres were not tried."""

COLUMNS = ["spheres", "gap", "tolerance", "error", "estimate", "status"]


def sampled(number: int, tolerances=(1e-2, 1e-3, 1e-5), seed: int = 1, progress=None):
    """Estimate and error of `number` random clusters of 2 to 20 spheres, one row for each sphere.

    The truth is the solver's own at the tolerance FINE. Columns problem, cluster, spheres, gap
    (smallest [d_p]), tolerance, error and estimate, both as `error_estimate` is, and status.
    """
    rows = []
    for item in range(number):
        centres, radii, velocity, turning, gradient = _moving_cluster(seed, item)
        d = 2.0 * radii[:, None]
        for problem, given in (
            (resistance, (velocity, turning)),
            (mobility, (d * velocity, d**3 * turning)),
        ):
            scene = {"gradient": gradient, "radii": radii}
            exact = problem(centres, *given, **scene, tolerance=FINE)
            for tolerance in tolerances:
                found = problem(centres, *given, **scene, tolerance=tolerance)
                rows += [
                    (problem.__name__, item, *row)
                    for row in _rows(found, exact, problem, radii, tolerance)
                ]
        if progress is not None:
            progress(item + 1, number)
    return pd.DataFrame(rows, columns=["problem", "cluster", *COLUMNS])


def judged(number: int, tolerances=(1e-2, 1e-3), seed: int = 1, progress=None):
    """The same of `resistance` alone, by fundamental solutions, which share no code with it.

    They aim at JUDGE of the smallest tolerance, for clusters of KNOWN_NUMBERS; where gaps are
    narrow they end before. One more column, reference: their own error estimate of that sphere.
    """
    rows = []
    for item in range(number):
        centres, radii, velocity, turning, gradient = _moving_cluster(seed, item, KNOWN_NUMBERS)
        scene = (centres, velocity, turning, (0.0, 0.0, 0.0), gradient, radii)
        exact = reference_loads(*scene, tolerance=JUDGE * min(tolerances))
        for tolerance in tolerances:
            found = resistance(*scene, tolerance=tolerance)
            own = exact.error_estimate
            for row, known in zip(
                _rows(found, exact, resistance, radii, tolerance), own, strict=True
            ):
                rows.append((item, *row, known))
        if progress is not None:
            progress(item + 1, number)
    return pd.DataFrame(rows, columns=["cluster", *COLUMNS, "reference"])


def coverage(table: pd.DataFrame) -> pd.DataFrame:
    """Of loads of `judged`: how many, and the shares within the tolerance and their estimate.

    One row for each tolerance and number of spheres. Loads that the reference knows to JUDGE of the
    tolerance count, with its error estimate added to what is allowed. Columns tolerance, spheres,
    loads, known (those that count), converged, within (of those that converged) and covered.
    """
    table = table.assign(
        known=table["reference"] <= JUDGE * table["tolerance"],
        converged=table["status"] == "converged",
        within=table["error"] <= table["tolerance"] + table["reference"],
        covered=table["error"] <= table["estimate"] + table["reference"],
    )
    rows = []
    for (tolerance, spheres), own in table.groupby(["tolerance", "spheres"]):
        known = own[own["known"]]
        done = known[known["converged"]]
        rows.append(
            (tolerance, spheres, len(own), len(known), known["converged"].mean(),
             done["within"].mean(), known["covered"].mean())
        )  # fmt: skip
    columns = "tolerance spheres loads known converged within covered"
    return pd.DataFrame(rows, columns=columns.split())


def _moving_cluster(seed, item, numbers=NUMBERS):
    """Centres, radii, velocities, angular velocities and gradient of one random cluster."""
    rng = stream(Purpose.MOVING_SAMPLE, seed, item)
    centres, radii = _cluster(rng, numbers)
    n, d = len(radii), 2.0 * radii[:, None]
    velocity, turning = rng.standard_normal((2, n, 3)) * np.stack([np.ones_like(d), 1.0 / d])
    if rng.random() < 0.3:
        velocity[:], turning[:] = velocity[0], 0.0
    gradient = rng.standard_normal((3, 3)) * (rng.random() < 0.5)
    gradient -= np.trace(gradient) / 3.0 * np.eye(3)
    return centres, radii, velocity, turning, gradient


def _rows(found, exact, problem, radii, tolerance) -> list[tuple]:
    """COLUMNS of each sphere of a solution."""
    n, d = len(radii), 2.0 * radii
    parts = [
        np.linalg.norm((getattr(found, name) - getattr(exact, name)).reshape(n, -1), axis=1)
        / d**power
        for name, power in OUTPUTS[problem].items()
    ]
    error = np.max(parts, axis=0) / found.scale
    return [
        (n, found.minimum_gap, tolerance, error[i], found.error_estimate[i], str(found.status))
        for i in range(n)
    ]


def _cluster(rng, numbers) -> tuple[np.ndarray, np.ndarray]:
    """Centres (n, 3) and radii (n,) [d_p], each sphere next to one that is there already."""
    n = int(rng.choice(numbers))
    radii = np.full(n, RADIUS)
    if rng.random() < 0.5:
        radii = np.exp(rng.uniform(*np.log(RADII), n))
    widest = rng.choice([0.3, 3.0, 30.0])
    centres = np.zeros((1, 3))
    while len(centres) < n:
        k, own = rng.integers(len(centres)), radii[len(centres)]
        gap = np.exp(rng.uniform(*np.log([SMALLEST_GAP, widest])))
        direction = rng.standard_normal(3)
        place = centres[k] + (radii[k] + own + gap) * direction / np.linalg.norm(direction)
        apart = np.linalg.norm(centres - place, axis=1) - radii[: len(centres)] - own
        if apart.min() >= 0.999 * SMALLEST_GAP:
            centres = np.vstack([centres, place])
    return centres, radii


def cost(numbers, fractions=(0.01, 0.1), tolerance: float = 1e-3, seed: int = 1) -> pd.DataFrame:
    """Velocities of random clouds that settle, on this thread.

    Columns spheres, volume_fraction, tolerance, seconds (after one to warm up; processor time),
    iterations, error_estimate (largest), status, gap (smallest [d_p]) and memory (GiB, stated).
    """
    rows = []
    mobility([[0, 0, 0], [0, 0, 1.1], [0, 0, 4.0]], np.ones((3, 3)))
    for phi in fractions:
        for n in numbers:
            centres = random_cloud(n, phi, stream(Purpose.BENCHMARK, seed, n))
            start = time.process_time()
            found = mobility(centres, np.tile([0.0, 0.0, -1.0], (n, 1)), tolerance=tolerance)
            seconds = time.process_time() - start
            memory = needed_memory(centres, tolerance=tolerance) / 2**30
            rows.append(
                (n, phi, tolerance, seconds, found.iterations, found.error_estimate.max(),
                 str(found.status), found.minimum_gap, memory)
            )  # fmt: skip
    columns = (
        "spheres volume_fraction tolerance seconds iterations error_estimate status gap memory"
    )
    return pd.DataFrame(rows, columns=columns.split())


if __name__ == "__main__":
    samples = sampled(200)
    samples["ratio"] = samples["estimate"] / samples["error"].clip(lower=1e-12)
    samples["covered"] = samples["estimate"] >= samples["error"]
    samples["within"] = samples["error"] <= samples["tolerance"]
    samples["converged"] = samples["status"] == "converged"
    groups = samples.groupby(["problem", "tolerance"])
    print(groups[["covered", "within", "converged"]].mean().to_string())
    print(groups["ratio"].describe(percentiles=[0.001, 0.01, 0.5]).to_string(float_format="%.3g"))
    print(coverage(judged(60)).to_string(index=False, float_format="%.3g"))
    print(cost([2, 10, 30, 100, 300, 1000]).to_string(float_format="%.3g"))
