"""Exhaustive verification: the prover, the independent checker and exact maps."""
