"""One thread for every numerical library, before the first of them is imported."""

import os

import pytest

for library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")


def pytest_collection_modifyitems(items):
    """Put the campaign first: where several processes share the files it would end last."""
    items.sort(key=lambda item: item.path.name != "test_campaign.py")


@pytest.fixture(scope="session")
def samples():
    """Scenes and forces that models of a test learn from."""
    from tests.forces.scenes import corrected_forces, random_neighbours

    neighbours = random_neighbours(3000, seed=1)
    return neighbours, corrected_forces(neighbours)


@pytest.fixture(scope="session")
def models(samples):
    """A model of each kind, trained for a moment."""
    from dustfall.training import TrainingSettings, train_model
    from tests.forces.scenes import LAYERS

    settings = TrainingSettings(batch_size=128, epochs=25, validate_every=5)
    return {kind: train_model(kind, *samples, layers, settings) for kind, layers in LAYERS.items()}
