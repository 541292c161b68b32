"""Fused kernels and shortcuts that make training faster; without them it gives the same."""
