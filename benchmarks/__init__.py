"""Benchmarks that measure the figures of the README: ratios within a run, with raw rates."""
