"""Boundary elements on gmsh meshes: quadrature, single layer, solve, the paper's formulation."""
