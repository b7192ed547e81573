"""Random scenes of nearest neighbours, and the volume fraction that a scene stands for."""

import numpy as np

from dustfall.columns import Column
from dustfall.streams import Purpose, stream
from dustfall.units import NEIGHBOURS, SPHERE_VOLUME

LAWS = ("uniform", "ball", "contact")
"""Radial laws: `uniform`, radii uniform between contact and the farthest neighbour (the law that
comes nearest to the paper's statistics); `ball`, points uniform in the ball (a dilute random
suspension); `contact`, as `uniform`, but one neighbour nearly touches the reference sphere, and
another one is the farthest."""

NEAR_CONTACT = (1e-3, 0.1)
"""Gap [d_p] of the nearly touching neighbour of the law `contact`, uniform in this range: scenes
that are rare under the other laws, and the hardest to predict."""

MOST_DRAWS = 10_000
"""Draws after which a scene is given up; at the `densest` a few hundred suffice."""

MOST_PLACED = 20
"""Most neighbours of a random scene: more do not find room near the reference sphere by the law
`uniform`, which crowds them there."""

SCENE_COLUMNS = {
    "neighbours": Column("d_p", "centres of the nearest spheres, sorted by distance"),
    "volume_fraction": Column("1", "phi = 3 k V_p / (4 pi d_k^3), d_k that of the farthest of k"),
    "scene": Column("1", "number of the scene within its radial law"),
}
"""Columns of a shard of scenes."""


def volume_fraction(distance, neighbours: int = NEIGHBOURS):
    """phi = 3 k V_p / (4 pi d_k^3): k spheres in the ball that reaches to the centre of the k-th.

    distance: d_k [d_p], of the farthest of k `neighbours` (paper, Eq. 6, for k = 5).
    """
    return _shell(neighbours) / np.asarray(distance, dtype=float) ** 3


def farthest_distance(phi, neighbours: int = NEIGHBOURS):
    """Distance [d_p] of the k-th neighbour at volume fraction phi: `volume_fraction` inverted."""
    return np.cbrt(_shell(neighbours) / np.asarray(phi, dtype=float))


def densest(neighbours: int = NEIGHBOURS) -> float:
    """Highest volume fraction of a scene, at which random placement without overlap is still quick.

    That of five neighbours within 2 d_p, and for fewer of theirs within 2 d_p.
    """
    return float(volume_fraction(2.0, min(neighbours, NEIGHBOURS)))


def _shell(neighbours: int) -> float:
    """phi d_k^3 [d_p^3]."""
    return 3.0 * neighbours * SPHERE_VOLUME / (4.0 * np.pi)


def random_scene(
    seed: int, law: str, number: int, phi_range, neighbours: int = NEIGHBOURS
) -> tuple[np.ndarray, float]:
    """Neighbours (k, 3) [d_p], nearest first, around a sphere at the origin, and their phi.

    log(phi) is uniform over phi_range; the last of k `neighbours` lies at `farthest_distance`, the
    others as the radial law says; directions are isotropic. A neighbour that overlaps an
    earlier one is drawn again. The random stream depends on (seed, law, number) alone.

    Raises ValueError if the law is unknown, or the range cannot hold so many neighbours.
    """
    if law not in LAWS:
        raise ValueError(f"radial law {law!r}: allowed are {', '.join(LAWS)}")
    fewest = 2 if law == "contact" else 1
    if not fewest <= neighbours <= MOST_PLACED:
        raise ValueError(f"{neighbours} neighbours: allowed are {fewest} to {MOST_PLACED}")
    low, high = phi_range
    if not 0.0 < low <= high <= densest(neighbours):
        raise ValueError(
            f"phi range {low} to {high}: allowed are 0 < lowest <= highest <= "
            f"{densest(neighbours):.4g}"
        )
    rng = stream(Purpose.SCENE, seed, LAWS.index(law), number)
    phi = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    farthest = float(farthest_distance(phi, neighbours))
    placed = [np.zeros(3), farthest * _direction(rng)]
    draws = 0
    while len(placed) <= neighbours:
        draws += 1
        if draws > MOST_DRAWS:
            raise ValueError(
                f"scene {number}: no room for {neighbours} neighbours at phi = {phi:.3g}"
            )
        if law == "contact" and len(placed) == 2:
            radius = 1.0 + rng.uniform(*NEAR_CONTACT)
        elif law == "ball":
            radius = np.cbrt(rng.uniform(1.0, farthest**3))
        else:
            radius = rng.uniform(1.0, farthest)
        candidate = radius * _direction(rng)
        if all(np.sum((candidate - other) ** 2) > 1.0 for other in placed):
            placed.append(candidate)
    centres = np.array(placed[1:])
    return centres[np.argsort(np.linalg.norm(centres, axis=1))], phi


def random_scenes(
    seed: int, law: str, numbers, phi_range, neighbours: int = NEIGHBOURS
) -> tuple[np.ndarray, np.ndarray]:
    """Several scenes: centres (m, k, 3) [d_p] and phi (m,); see `random_scene`."""
    scenes = [random_scene(seed, law, int(number), phi_range, neighbours) for number in numbers]
    centres = np.array([scene[0] for scene in scenes]).reshape(-1, neighbours, 3)
    return centres, np.array([scene[1] for scene in scenes])


def _direction(rng) -> np.ndarray:
    """Isotropic unit vector."""
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)
