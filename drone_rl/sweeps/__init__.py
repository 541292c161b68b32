"""Sweeps: many training runs in parallel, resumed, summarised and reported together."""
