"""What five neighbours leave out: forces in a frozen random cloud, from few neighbours to all."""

import numpy as np
import pandas as pd
import scipy

from dustfall.forces.formulas import FORMULAS
from dustfall.sedimentation.neighbours import nearest_neighbours
from dustfall.sedimentation.start import random_positions
from dustfall.sedimentation.state import box_length
from dustfall.streams import Purpose, stream
from dustfall.suspension.batchelor import BATCHELOR_COEFFICIENT
from dustfall.suspension.periodic import HASIMOTO, periodic_mobility
from dustfall.suspension.rotne_prager import rotne_prager_forces
from dustfall.units import AXES, RADIUS, STOKES_DRAG

FLOW = AXES["streamwise"]

COUNTS = (1, 2, 5, 10, 20, 50, 100, 200, 400)
"""Neighbours that a particle is given in turn."""

SAFETY = 5
"""Standard deviations of the number of particles in a ball that its mean must leave room for."""

REFERENCES = 25
"""Particles of a cloud that are given many neighbours, each a dense system of its own."""


def five_neighbour_drag(positions, length: float) -> np.ndarray:
    """Drag (n,) over Stokes drag on each sphere of a periodic cloud fixed in a uniform flow.

    Each sphere sees its five nearest alone, in unbounded fluid (inverted Rotne-Prager mobility).
    """
    neighbours, _ = nearest_neighbours(positions, length)
    return FORMULAS["rotne_prager"].predict(neighbours)[:, FLOW] / STOKES_DRAG


def drag_among_nearest(positions, length: float, references, count: int) -> np.ndarray:
    """Drag over Stokes drag on some spheres of a periodic cloud, each among its `count` nearest.

    Raises ValueError where these would reach beyond half the box, where images are met twice.
    """
    tree = scipy.spatial.cKDTree(positions % length, boxsize=length)
    distance, index = tree.query(positions[references] % length, count + 1)
    if distance.max() > length / 2:
        raise ValueError(
            f"{count} neighbours reach {distance.max():.4g} d_p, more than half the box length "
            f"of {length:.4g} d_p; the cloud needs more than {len(positions)} particles"
        )
    drag = np.empty(len(index))
    for i, those in enumerate(index):
        centres = positions[those] - positions[those[0]]
        centres -= length * np.rint(centres / length)
        drag[i] = rotne_prager_forces(centres)[0, FLOW] / STOKES_DRAG
    return drag


def all_particle_motion(positions, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Drag and settling velocity (n,) with all spheres and images, over those of a lone sphere.

    No net flux of spheres and fluid together (`periodic_mobility`). The drag is that on spheres
    which all move with the same velocity, the velocity that under equal weights. A finite cube
    slows the cloud by Hasimoto's correction, which is added back to the velocity, so that its mean
    stands for an infinite suspension (Ladd 1990, J. Chem. Phys. 93, 3484).
    """
    mobility = periodic_mobility(positions, length)
    along = np.tile(np.eye(3)[FLOW], len(positions))
    drag = np.linalg.solve(mobility, along).reshape(-1, 3)[:, FLOW]
    velocity = (mobility @ along).reshape(-1, 3)[:, FLOW]
    return drag, velocity + HASIMOTO * RADIUS / length


def frozen_cloud_table(
    volume_fractions, particles: int, clouds: int, seed: int, progress=None
) -> pd.DataFrame:
    """Compare the five-neighbour closure with all particles, in random clouds without overlap.

    Parameters: `volume_fractions`, `particles` of a cloud, `clouds` of each volume fraction (at
    least two), `seed`, `progress` (clouds done, of all).

    Clouds of one number are the same draws at each volume fraction, so that differences between
    these are sharper than the intervals.

    Returns the columns panel, source, volume_fraction, x, y, low, high (95 % interval of the mean,
    from the spread between clouds). Panel "neighbours": mean drag y among x neighbours in unbounded
    fluid. Panel "particles": five-neighbour drag x and all-particle drag y of each sphere of the
    densest case's first cloud. Panel "correlation": their coefficient y at phi = x. Panel
    "settling": velocity y at phi = x of the sources "five neighbours" (mean 1/beta), "all
    particles" and "Batchelor 1972"; panel "drag": the mean drag of the first two.

    Raises ValueError for fewer than two clouds.
    """
    if clouds < 2:
        raise ValueError(f"clouds is {clouds}: an interval needs at least 2")
    # Beyond half the box length images are met twice; a ball of that size holds pi/6 of the cloud,
    # give or take its scatter.
    share = np.pi / 6
    surely = share * particles - SAFETY * np.sqrt(particles * share * (1 - share))
    counts = [count for count in COUNTS if count <= surely]
    rows = []
    for case, phi in enumerate(volume_fractions):
        found: dict[tuple, list[float]] = {}
        for cloud in range(clouds):
            rng = stream(Purpose.FROZEN_CLOUD, seed, cloud)
            length = box_length(particles, phi)
            positions = random_positions(rng, particles, phi)
            five = five_neighbour_drag(positions, length)
            drag, velocity = all_particle_motion(positions, length)
            means = {
                ("drag", "five neighbours", phi): five.mean(),
                ("drag", "all particles", phi): drag.mean(),
                ("correlation", "five neighbours, all particles", phi): np.corrcoef(five, drag)[
                    0, 1
                ],
                ("settling", "five neighbours", phi): (1 / five).mean(),
                ("settling", "all particles", phi): velocity.mean(),
            }
            for count in counts:
                some = drag_among_nearest(positions, length, slice(REFERENCES), count)
                means["neighbours", "nearest neighbours", count] = some.mean()
            for key, value in means.items():
                found.setdefault(key, []).append(value)
            if phi == max(volume_fractions) and cloud == 0:
                head = {"panel": "particles", "source": "one cloud", "volume_fraction": phi}
                rows += [head | {"x": x, "y": y} for x, y in zip(five, drag, strict=True)]
            if progress:
                progress(case * clouds + cloud + 1, len(volume_fractions) * clouds)
        for (panel, source, x), values in found.items():
            mean = np.mean(values)
            half = scipy.stats.t.ppf(0.975, clouds - 1) * np.std(values, ddof=1) / np.sqrt(clouds)
            head = {"panel": panel, "source": source, "volume_fraction": phi, "x": x}
            rows.append(head | {"y": mean, "low": mean - half, "high": mean + half})
        head = {"panel": "settling", "source": "Batchelor 1972", "volume_fraction": phi, "x": phi}
        rows.append(head | {"y": 1 + BATCHELOR_COEFFICIENT * phi})
    table = pd.DataFrame(rows)[["panel", "source", "volume_fraction", "x", "y", "low", "high"]]
    return table.sort_values(["panel", "source", "volume_fraction", "x"], ignore_index=True)
