"""The mesh study's table: errors, observed order, the paper's points."""

import numpy as np
import pandas as pd
import pytest

from dustfall.analysis.mesh_study import mesh_study_table


def study(error, nodes=(50, 100, 200, 400), scheme="flat", limit=24.0):
    nodes = np.array(nodes)
    force = 24 * (1 + error(nodes))
    return pd.DataFrame(
        {
            "scheme": scheme,
            "nodes": nodes,
            "share": 1.0,
            "elements": 2 * nodes - 4,
            "force": force,
            "limit": limit,
        }
    )


def test_order_is_that_of_the_error_in_element_size():
    table = mesh_study_table(study(lambda nodes: -3.0 / nodes))
    ours = table[table["scheme"] == "flat"]
    np.testing.assert_allclose(ours["order"], 2)
    np.testing.assert_allclose(ours["error"], 3.0 / ours["nodes"])


def test_order_is_that_towards_the_limit_of_the_formulation():
    table = mesh_study_table(study(lambda nodes: 0.01 - 3.0 / nodes, limit=24.24))
    ours = table[table["scheme"] == "flat"]
    np.testing.assert_allclose(ours["order"], 2)
    np.testing.assert_allclose(ours["error"], np.abs(0.01 - 3.0 / ours["nodes"]))


def test_the_papers_points_stand_beside_and_have_no_order_as_they_pass_through_24():
    paper = mesh_study_table(study(lambda n: 1 / n)).query("scheme == 'paper'")
    assert len(paper) == 6
    assert paper["order"].isna().all()
    chosen = paper[paper["nodes"].round() == 827]
    assert chosen["error"].iloc[0] == pytest.approx(0.075, abs=5e-4)


def test_two_meshes_have_no_order():
    table = mesh_study_table(study(lambda n: 1 / n, nodes=(50, 100)))
    assert table["order"].isna().all()


def test_bad_studies_are_refused():
    good = study(lambda n: 1 / n)
    with pytest.raises(ValueError, match="'elements'"):
        mesh_study_table(good.drop(columns="elements"))
    with pytest.raises(ValueError, match="empty"):
        mesh_study_table(good.iloc[:0])
    with pytest.raises(ValueError, match="'paper'"):
        mesh_study_table(good.assign(scheme="paper"))
    with pytest.raises(ValueError, match="finite forces"):
        mesh_study_table(good.assign(force=np.nan))
