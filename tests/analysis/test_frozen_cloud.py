"""Frozen clouds: the closure is one of five neighbours, and all particles settle as theory says."""

import numpy as np
import pytest

from dustfall.analysis.frozen_cloud import (
    all_particle_motion,
    drag_among_nearest,
    five_neighbour_drag,
    frozen_cloud_table,
)
from dustfall.sedimentation.start import random_positions
from dustfall.sedimentation.state import box_length


def cloud(phi, seed, n=150):
    return random_positions(np.random.default_rng(seed), n, phi), box_length(n, phi)


def test_five_nearest_are_the_closure():
    positions, length = cloud(1e-3, 1)
    np.testing.assert_allclose(
        drag_among_nearest(positions, length, slice(20), 5),
        five_neighbour_drag(positions, length)[:20],
        rtol=1e-10,
    )


def test_more_neighbours_take_away_more_drag_without_end():
    positions, length = cloud(1e-3, 2)
    drag = [drag_among_nearest(positions, length, slice(10), k).mean() for k in (1, 5, 20, 60)]
    assert (np.diff(drag) < -0.1).all()
    with pytest.raises(ValueError, match="more than half the box"):
        drag_among_nearest(positions, length, slice(10), 120)


def test_the_whole_cloud_settles_as_slowly_as_theory_says_and_a_fixed_bed_resists():
    phi = 1e-2
    motion = [all_particle_motion(*cloud(phi, seed)) for seed in range(8)]
    velocity = [v.mean() for _, v in motion]
    # Rotne-Prager spheres without stresslets: 1 - 5 phi (Brady & Durlofsky 1988).
    error = np.std(velocity, ddof=1) / np.sqrt(len(velocity))
    assert np.mean(velocity) == pytest.approx(1 - 5 * phi, abs=3 * error)
    assert error < 0.02
    # Brinkman: 1 + 3 sqrt(phi / 2), in the first order.
    drag = np.mean([d.mean() for d, _ in motion])
    assert drag == pytest.approx(1 + 3 * np.sqrt(phi / 2), abs=0.08)


def test_the_table_holds_its_panels_and_does_not_depend_on_order():
    table = frozen_cloud_table([1e-5, 1e-3], 120, 2, seed=1)
    assert set(table["panel"]) == {"neighbours", "particles", "correlation", "settling", "drag"}
    assert (table["panel"] == "particles").sum() == 120
    settling = table[table["panel"] == "settling"].set_index(["source", "x"])
    five = settling.loc[("five neighbours", 1e-3)]
    assert five["low"] < five["y"] < five["high"]
    assert 1.3 < five["y"] < 1.6
    assert abs(settling.loc[("all particles", 1e-5), "y"] - 1) < 0.05
    few = frozen_cloud_table([1e-4, 1e-5], 120, 2, seed=1)
    first = settling.loc[("five neighbours", 1e-5), "y"]
    assert few.set_index(["panel", "source", "x"]).loc[
        ("settling", "five neighbours", 1e-5), "y"
    ] == pytest.approx(first, rel=1e-12)
    with pytest.raises(ValueError, match="clouds is 1"):
        frozen_cloud_table([1e-3], 100, 1, seed=1)
