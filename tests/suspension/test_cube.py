"""Positions folded into the periodic cube."""

import numpy as np

from dustfall.suspension.cube import folded


def test_coordinates_just_below_whole_sides_stay_inside():
    side = 37.123456789
    below = np.nextafter(side * np.arange(2000.0), -np.inf)
    position = np.stack([below, below[::-1], below], axis=1)
    inside = folded(position, side)
    assert (inside >= 0.0).all()
    assert (inside < side).all()
