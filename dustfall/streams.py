"""Random streams: each depends on its purpose, the seed and an item, and on nothing else.

So neither the order of jobs, nor the size of a shard, nor the number of threads shows in a number
that was drawn, and no two purposes ever share one.
"""

from enum import IntEnum

import numpy as np


class Purpose(IntEnum):
    """What random numbers are drawn for; a number that once had a purpose is never reused."""

    SCENE = 1  # items: radial law, number of the scene
    TEST_SCENES = 2  # radial law
    NEIGHBOUR_ORDER = 3  # radial law, number of the scene
    LEARNING_CURVE = 4
    VALIDATION = 5
    FOLDS = 6
    NETWORK = 7  # fold (0 outside a cross-validation), component
    START = 8  # case
    TRACKED = 9  # case
    PROBES = 10
    RANDOM_SPHERES = 11  # cloud
    FROZEN_CLOUD = 12  # cloud
    BOOTSTRAP = 13  # number of samples
    AUDIT = 14  # radial law, decade
    BENCHMARK = 15  # number of spheres
    STRESS = 16  # test, number
    TRUNCATION = 17  # kind of cluster, number
    EXPORT = 18
    BACK_FLOW = 19
    MOVING = 20  # set, number
    MOVING_SAMPLE = 21  # number of the cluster
    MOVING_SPHERES = 22  # number of the volume fraction


def stream(purpose: Purpose, seed: int, *items: int) -> np.random.Generator:
    """The random numbers of `purpose` for a campaign's seed and an item of it.

    Raises ValueError for a seed or an item that is no integer from 0 to 2^32 - 1.
    """
    return np.random.default_rng(sequence(purpose, seed, *items))


def sequence(purpose: Purpose, seed: int, *items: int) -> np.random.SeedSequence:
    """The seed of `stream`, for generators that are not NumPy's."""
    for value in (seed, *items):
        # A larger one would be taken for two.
        if value != int(value) or not 0 <= value < 2**32:
            raise ValueError(f"seed and items are {(seed, *items)}; integers 0 to 2^32 - 1 allowed")
    # A key is mixed in after the seed has been padded, so that (1), (1, 0) and (1, 0, 0) differ,
    # which they do not as entropy.
    key = (int(purpose), *map(int, items))
    return np.random.SeedSequence(int(seed), spawn_key=key)
