"""Clusters of spheres whose forces are known: centres [d_p] of neighbours s radii apart."""

import numpy as np


def triangle(s):
    return s / 2.0 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])


def chain(s):
    return s / 2.0 * np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def six(s):
    arms = [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    return s / 2.0 * np.array(arms, dtype=float)
