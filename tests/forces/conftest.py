import pytest

from dustfall.forces import TrainingSettings, train_model
from tests.forces.scenes import LAYERS, corrected_forces, random_neighbours


@pytest.fixture(scope="session")
def samples():
    neighbours = random_neighbours(3000, seed=1)
    return neighbours, corrected_forces(neighbours)


@pytest.fixture(scope="session")
def models(samples):
    settings = TrainingSettings(batch_size=128, epochs=25, validate_every=5)
    return {kind: train_model(kind, *samples, layers, settings) for kind, layers in LAYERS.items()}
