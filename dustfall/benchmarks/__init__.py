"""Run time against error, and what strains the solver."""
