"""What is known of a dilute random suspension without measuring it."""

BATCHELOR_COEFFICIENT = -6.55
"""Settling velocity of a dilute random suspension is 1 + this times phi (Batchelor 1972)."""
