"""Random five-neighbour scenes, and the volume fraction that a scene stands for."""

import numpy as np

from dustfall.columns import Column
from dustfall.streams import Purpose, stream
from dustfall.units import NEIGHBOURS, SPHERE_VOLUME

LAWS = ("uniform", "ball", "contact")
"""Radial laws: `uniform`, radii uniform between contact and the fifth distance (the law that
reproduces the paper's statistics); `ball`, points uniform in the ball (a dilute random suspension);
`contact`, as `uniform`, but one neighbour nearly touches the reference sphere."""

NEAR_CONTACT = (1e-3, 0.1)
"""Gap [d_p] of the nearly touching neighbour of the law `contact`, uniform in this range: scenes
that are rare under the other laws, and the hardest to predict."""

FIFTH_SHELL = 15.0 * SPHERE_VOLUME / (4.0 * np.pi)
"""phi d_5^3 [d_p^3]: five spheres in the ball that reaches to the centre of the fifth."""

DENSEST = FIFTH_SHELL / 2.0**3
"""Volume fraction of d_5 = 2 d_p, where random placement without overlap is still quick."""

MOST_DRAWS = 10_000
"""Draws after which a scene is given up; at `DENSEST` a few hundred suffice."""

SCENE_COLUMNS = {
    "neighbours": Column("d_p", "centres of the nearest spheres, sorted by distance"),
    "volume_fraction": Column("1", "phi = 15 V_p / (4 pi d_5^3), d_5 the fifth distance"),
    "scene": Column("1", "number of the scene within its radial law"),
}
"""Columns of a shard of scenes."""


def volume_fraction(d5):
    """phi = 15 V_p / (4 pi d_5^3), d5 [d_p] the distance of the fifth neighbour (paper, Eq. 6)."""
    return FIFTH_SHELL / np.asarray(d5, dtype=float) ** 3


def fifth_distance(phi):
    """Distance [d_p] of the fifth neighbour at volume fraction phi: `volume_fraction` inverted."""
    return np.cbrt(FIFTH_SHELL / np.asarray(phi, dtype=float))


def random_scene(seed: int, law: str, number: int, phi_range) -> tuple[np.ndarray, float]:
    """Five neighbours (5, 3) [d_p], nearest first, around a sphere at the origin, and their phi.

    log(phi) is uniform over phi_range; the fifth neighbour lies at `fifth_distance(phi)`, the
    other four as the radial law says; directions are isotropic. A neighbour that overlaps an
    earlier one is drawn again. The random stream depends on (seed, law, number) alone.

    Raises ValueError if the law is unknown or the range cannot hold five neighbours.
    """
    if law not in LAWS:
        raise ValueError(f"radial law {law!r}: allowed are {', '.join(LAWS)}")
    low, high = phi_range
    if not 0.0 < low <= high <= DENSEST:
        raise ValueError(
            f"phi range {low} to {high}: allowed are 0 < lowest <= highest <= {DENSEST:.4g}"
        )
    rng = stream(Purpose.SCENE, seed, LAWS.index(law), number)
    phi = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    d5 = float(fifth_distance(phi))
    placed = [np.zeros(3), d5 * _direction(rng)]
    draws = 0
    while len(placed) <= NEIGHBOURS:
        draws += 1
        if draws > MOST_DRAWS:
            raise ValueError(f"scene {number}: no room for five neighbours at phi = {phi:.3g}")
        if law == "contact" and len(placed) == 2:
            radius = 1.0 + rng.uniform(*NEAR_CONTACT)
        elif law == "ball":
            radius = np.cbrt(rng.uniform(1.0, d5**3))
        else:
            radius = rng.uniform(1.0, d5)
        candidate = radius * _direction(rng)
        if all(np.sum((candidate - other) ** 2) > 1.0 for other in placed):
            placed.append(candidate)
    neighbours = np.array(placed[1:])
    return neighbours[np.argsort(np.linalg.norm(neighbours, axis=1))], phi


def random_scenes(seed: int, law: str, numbers, phi_range) -> tuple[np.ndarray, np.ndarray]:
    """Several scenes: neighbours (m, 5, 3) [d_p] and phi (m,); see `random_scene`."""
    scenes = [random_scene(seed, law, int(number), phi_range) for number in numbers]
    neighbours = np.array([scene[0] for scene in scenes]).reshape(-1, NEIGHBOURS, 3)
    return neighbours, np.array([scene[1] for scene in scenes])


def _direction(rng) -> np.ndarray:
    """Isotropic unit vector."""
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)
