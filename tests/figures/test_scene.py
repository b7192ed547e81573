"""Figures of meshed scenes and of the audit show what their tables hold."""

import numpy as np
import pandas as pd
import pytest

from dustfall.figures.audit import audit
from dustfall.figures.scene import scene_meshes
from dustfall.stokes.elements.mesh_files import element_table
from dustfall.stokes.elements.scene import fixed_spheres_on_meshes


@pytest.fixture(scope="module")
def elements():
    table = element_table(fixed_spheres_on_meshes([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]))
    eye = {"view_x": 0.0, "view_y": 0.0, "view_z": 0.0}
    return pd.concat(
        [table.assign(scene=k, title=f"scene {k}", **eye) for k in range(2)], ignore_index=True
    )


def test_each_scene_is_a_panel_of_about_half_of_its_elements(elements):
    panels = [ax for ax in scene_meshes(elements).axes if ax.get_title()]
    assert [ax.get_title() for ax in panels] == ["scene 0", "scene 1"]
    count = len(elements) / 2 / 6
    for ax in panels:
        drawn = len(ax.collections[0].get_facecolor())
        assert 0.5 * count < drawn < 0.9 * count


def test_a_scene_seen_from_the_other_side_shows_the_other_elements(elements):
    one = elements[elements["scene"] == 0].copy()
    high = one["y"] > 0.0
    one.loc[high, "pressure"], one.loc[~high, "pressure"] = 1.0, -1.0
    colours = []
    for y in (1.0, -1.0):
        figure = scene_meshes(one.assign(view_y=y))
        figure.canvas.draw()
        colours.append(figure.axes[0].collections[0].get_facecolor()[:, 0].mean())
    # High is red, low is blue.
    assert colours[0] > colours[1]


def test_the_audit_shows_every_comparison_that_found_a_force():
    frame = pd.DataFrame(
        {
            "radial_law": ["uniform", "uniform", "contact"],
            "method": ["elements", "paper", "elements"],
            "minimum_gap": [1.0, 1.0, 1e-6],
            "difference": [1e-5, 1e-2, np.nan],
            "estimate": [1e-4, 1e-1, np.inf],
            "estimate_recorded": [1e-6] * 3,
        }
    )
    left = audit(frame).axes[0]
    points = [x for line in left.lines if line.get_marker() != "None" for x in line.get_xdata()]
    np.testing.assert_allclose(sorted(points), [1.01e-4, 0.100001])
    with pytest.raises(ValueError, match="lacks the column"):
        audit(frame.drop(columns="estimate"))
