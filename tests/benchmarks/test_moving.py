"""The benchmark of moving spheres: clusters as named, methods that agree where they can."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from dustfall.benchmarks.moving import (
    EXACT,
    GAPS,
    all_spheres,
    moving,
    moving_methods,
    moving_sets,
)
from dustfall.benchmarks.solver import time_against_error
from dustfall.stokes.references.moving_pairs import loads_on_two_spheres


def test_clusters_are_no_closer_than_their_set_says_and_the_same_each_time():
    sets = moving_sets(5, seed=3)
    for name, (narrowest, widest) in GAPS.items():
        for centres, velocity, angular_velocity in sets[name]:
            assert velocity.shape == angular_velocity.shape == centres.shape
            assert 1.0 + narrowest <= pdist(centres).min() <= 1.0 + widest
    again = moving_sets(2, seed=3)
    for name, scenes in again.items():
        np.testing.assert_array_equal(scenes[1][0], sets[name][1][0])


def test_all_methods_find_the_forces_on_two_far_spheres():
    """As far apart as that, all are right to the errors of a lone sphere: those of its blobs."""
    motions = np.random.default_rng(1).normal(size=(2, 2, 3))
    centres = np.array([[0.0, 0.0, 0.0], [30.0, 40.0, 0.0]])
    exact = loads_on_two_spheres(centres, *motions).force
    for method in moving_methods([1e-3], 1, 1):
        scene = (centres, *motions)
        error, known = all_spheres(*method.forces(scene), exact, scene)
        assert error < 1e-3, method.name
        assert known is None or error <= known


def test_errors_and_estimates_are_those_of_the_scene():
    scenes = {"few": moving_sets(2)["moving, gaps from 0.2"]}
    methods = [m for m in moving_methods([1e-2, 1e-4], 2, 1) if m.name != "fundamental solutions"]
    table = time_against_error(
        scenes, methods, repeats=1, exact=moving(EXACT), compare=all_spheres
    ).set_index(["method", "setting"])
    ours = table.loc["multipoles"]
    assert (ours["covered"] == 1.0).all()
    assert (ours["error_max"].to_numpy() <= [1e-2, 1e-4]).all()
    blobs = table.loc["rigid multiblob", "error_max"]
    assert blobs["12 blobs"] > blobs["42 blobs"] > ours["error_max"].max()
    assert table.loc["Stokesian dynamics", "error_max"].item() == pytest.approx(4e-3, rel=0.9)
