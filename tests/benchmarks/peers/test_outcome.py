"""Criterion for solving the task."""

from benchmarks.peers.outcome import DECAY, TARGET


def test_458_perfect_episodes_are_not_enough_and_459_are():
    """A running mean that starts at 0 is 3 (1 - 0.99^n) after n episodes with all three cubes."""
    assert 3 * (1 - DECAY**458) < TARGET < 3 * (1 - DECAY**459)
