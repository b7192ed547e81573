"""Answers that share no code with the solver: exact pairs, fundamental solutions, multiblobs."""
