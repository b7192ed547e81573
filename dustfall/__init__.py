"""Stokes drag among neighbours: boundary elements, learned force models, sedimentation.

Lengths are in particle diameters d_p and forces in Re_p c_D unless a docstring says otherwise.
"""

__version__ = "0.1.0"

STOKES_DRAG = 24.0
"""Force on an isolated sphere along the flow, in Re_p c_D (paper, Eq. 1 made dimensionless)."""
