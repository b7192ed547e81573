"""Shards: what is written comes back, and cutting scenes otherwise changes no bit."""

import numpy as np

from dustfall.scenes import random_scenes
from dustfall.stokes.elements.mesh import sphere_mesh
from dustfall.stokes.elements.one_body import OneBody
from dustfall.stokes.records import (
    RECORD_UNITS,
    plan_shard,
    read_plans,
    solve_shard,
    write_plans,
    write_records,
)
from dustfall.stokes.solve import one_body_response


def test_plans_come_back_from_their_file(tmp_path):
    neighbours, _ = random_scenes(5, "uniform", range(6), (1e-5, 1e-3))
    plans = plan_shard(neighbours, 1e-4)
    write_plans(tmp_path / "meshes.h5", plans, np.arange(6), {"template_edge": 0.5})
    again, scene = read_plans(tmp_path / "meshes.h5")
    np.testing.assert_array_equal(scene, np.arange(6))
    for one, other in zip(plans, again, strict=True):
        for name in ("centres", "orders", "error"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_records_do_not_depend_on_the_shard(tmp_path):
    neighbours, _ = random_scenes(5, "uniform", range(8), (1e-4, 1e-3))
    response = one_body_response(OneBody.from_mesh(sphere_mesh(0.7)), 1e-4)
    plans = plan_shard(neighbours, 1e-4)
    seen = []
    whole = solve_shard(plans, response, 1e-4, lambda *progress: seen.append(progress))
    assert seen == [(k, 8) for k in range(1, 9)]
    parts = [solve_shard(plans[k : k + 3], response, 1e-4) for k in range(0, 8, 3)]
    for name in RECORD_UNITS:
        np.testing.assert_array_equal(
            whole[name], np.concatenate([part[name] for part in parts]), err_msg=name
        )
    assert whole["force"].shape == (8, 6, 3)
    assert whole["error_estimate"].shape == (8, 6)
    write_records(tmp_path / "one.h5", whole, np.arange(8))
    write_records(tmp_path / "other.h5", whole, np.arange(8))
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "other.h5").read_bytes()
