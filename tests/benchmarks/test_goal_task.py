"""The task of a goal behind boxes."""

from benchmarks.goal_task import blocked_share


def test_most_straight_paths_are_blocked():
    assert 0.8 < blocked_share(500) < 0.9
