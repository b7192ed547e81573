"""An element is cut until its parts are far enough from a target, and never silently less."""

import numpy as np
import pytest

from dustfall.stokes.elements.element import (
    MOST_PARTS,
    centre_and_reach,
    parts_facing,
    share_of_area,
)
from dustfall.stokes.elements.element_pairs import coupling, side
from dustfall.stokes.elements.mesh import sphere_mesh

CORNERS = np.eye(3)
MIDDLE = np.full(3, np.sqrt(1.0 / 3.0))


@pytest.mark.parametrize("height", [1.0, 0.1, 0.01])
def test_parts_cover_the_element_and_are_as_far_as_asked(height):
    parts = np.empty((MOST_PARTS, 3, 3))
    target = (1.0 + height) * MIDDLE
    count = parts_facing(target, CORNERS, False, 1.0, parts)
    assert sum(share_of_area(part) for part in parts[:count]) == pytest.approx(1.0, rel=1e-12)
    for part in parts[:count]:
        centre, reach = centre_and_reach(CORNERS, part, False)
        assert np.linalg.norm(target - centre) >= 2.0 * reach


def test_a_target_on_the_element_is_refused_and_not_cut_short():
    parts = np.empty((MOST_PARTS, 3, 3))
    centre, _ = centre_and_reach(CORNERS, np.eye(3), False)
    with pytest.raises(ValueError, match="too close"):
        parts_facing(centre + 1e-9, CORNERS, False, 1.0, parts)


def test_elements_of_a_gap_below_all_halvings_are_refused():
    own = side(sphere_mesh(1.3), 1e-3)
    with pytest.raises(ValueError, match="gap too narrow"):
        coupling(own, own, (0.0, 0.0, 1e-9))
