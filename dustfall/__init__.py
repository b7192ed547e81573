"""Stokes drag among neighbours: Stokes solvers, learned force models, sedimentation.

Lengths are in particle diameters d_p and forces in Re_p c_D unless a docstring says otherwise.
"""

from dustfall.kernels import find_cache_folder

__version__ = "0.2.0"

find_cache_folder()
