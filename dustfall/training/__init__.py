"""Training of the learned force models in PyTorch."""

from dustfall.training.cross_validation import choose_winner, cross_validate
from dustfall.training.fit import PAPER_SETTINGS, SETTINGS, TrainingSettings, train_model

__all__ = [
    "PAPER_SETTINGS",
    "SETTINGS",
    "TrainingSettings",
    "choose_winner",
    "cross_validate",
    "train_model",
]
