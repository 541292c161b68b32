"""Robustness: success rates under perturbations, and the operating domain."""
