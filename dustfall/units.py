"""The units of every number: lengths in particle diameters d_p, forces in Re_p c_D.

Re_p c_D is the force over (pi / 8) rho U nu d_p, U the velocity of the flow that a sphere meets:
an isolated sphere feels 3 pi mu U d_p, which is 24 (paper, Eq. 1 made dimensionless).
"""

import numpy as np

RADIUS = 0.5
"""Radius of every sphere [d_p]."""

CONTACT = 1.0
"""Centre distance of two touching spheres [d_p]."""

SPHERE_VOLUME = np.pi / 6.0
"""Volume of a sphere [d_p^3]."""

STOKES_DRAG = 24.0
"""Force on an isolated sphere along the flow [Re_p c_D]."""

FORCE_UNIT = STOKES_DRAG / (3.0 * np.pi)
"""Re_p c_D for a force of one mu U d_p: an isolated sphere feels 3 pi mu U d_p."""

NEIGHBOURS = 5
"""Neighbours that a scene has, as in the paper."""

AXES = {"spanwise": 0, "streamwise": 1, "vertical": 2}
"""Column of each direction in an array (..., 3): x spanwise, y streamwise, z vertical."""

COMPONENTS = {"streamwise": (1,), "lateral": (0, 2)}
"""Columns of the parts of a force: along the flow, and across it (spanwise and vertical)."""
