"""Scenes and forces that the tests of the force models share."""

import numpy as np

from dustfall.forces.formulas.reflections import MODEL as REFLECTED

LAYERS = {
    "dense": "24-24",
    "dense_sorted": "24-24",
    "pairwise": "16-16",
    "idnn": "24-24/16-16",
    "anchored": "16-16/12-12",
}


def random_neighbours(scenes, seed=0, nearest=1.0, farthest=397.0, number=5):
    """Isotropic directions; log-uniform size of the scene, distances uniform within it."""
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(scenes, number, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    size = np.exp(rng.uniform(np.log(8.0), np.log(farthest), (scenes, 1)))
    distance = rng.uniform(nearest, size, (scenes, number))
    return distance[:, :, None] * direction


def corrected_forces(neighbours):
    """Forces of the reflections with a correction of each pair that has the symmetries.

    Its form, r r / |r|^6, is that of the first term (stresslet reflected by the other sphere)
    that the Rotne-Prager mobility leaves out.
    """
    distance = np.linalg.norm(neighbours, axis=2, keepdims=True)
    correction = (neighbours[:, :, 1:2] * neighbours / distance**6).sum(axis=1)
    return REFLECTED.predict(neighbours) - 4.0 * correction
