import pytest
import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.sim.tasks import Goals
from drone_rl.sim.tasks.collect_cubes import CubesEnd, Side
from drone_rl.trust.metrics import failure_table
from drone_rl.utils.intervals import proportion
from tests.second_task import End, Posts

LEFT, AHEAD, RIGHT = Side


def row(table, by, value):
    (found,) = [r for r in table.rows if (r.by, r.value) == (by, value)]
    return found.episodes, found.failed


@pytest.fixture
def episodes(make_episodes):
    """Fails at the second, a cube on the right; at the first, on the left; at none."""
    sides = [[LEFT, RIGHT, LEFT], [LEFT, -1, -1], [AHEAD, AHEAD, RIGHT]]
    hits = [[1, 0, 0], [0, 0, 0], [1, 1, 1]]
    return make_episodes(sides, hits, end=[CubesEnd.FRONT_BOUNDARY, CubesEnd.SIDE_BOUNDARY, 0])


def test_episode_fails_once_at_its_first_miss(episodes):
    table = failure_table(episodes)
    assert row(table, "cube", "first") == (3, 1)
    assert row(table, "cube", "second") == (2, 1)  # the second episode never came so far
    assert row(table, "cube", "third") == (1, 0)  # what comes after a failure doesn't count
    assert row(table, "side", "left") == (2, 1)  # the missed third cube of the first doesn't
    assert row(table, "side", "ahead") == (1, 0)
    assert row(table, "side", "right") == (2, 1)
    assert row(table, "sideways", "1.65 to 4 m") == (3, 2)
    assert row(table, "sideways", "more than 9 m") == (0, 0)
    assert row(table, "end", "front_boundary") == (3, 1)
    assert row(table, "end", "side_boundary") == (3, 1)
    assert row(table, "end", "step_limit") == (3, 0)
    assert table.bound == proportion(2, 3)
    assert table.largest.value == "1.65 to 4 m"


def test_failure_intervals_are_simultaneous(episodes):
    rows = failure_table(episodes).rows
    assert len(rows) == 3 + 3 + 4 + 4
    exact = proportion(1, 2, 1 - 0.05 / len(rows))
    second = next(r for r in rows if r.value == "second")
    assert (second.lower95, second.upper95) == (exact.lower95, exact.upper95)
    assert second.share == 0.5


def test_failure_table_without_failures(make_episodes):
    table = failure_table(make_episodes([[LEFT, RIGHT]] * 400, [[1, 1]] * 400))
    assert table.largest is None
    assert table.bound.upper95 == pytest.approx(1 - 0.025 ** (1 / 400))


def test_expected_end_is_not_the_largest_failure(make_episodes):
    table = failure_table(make_episodes([[LEFT], [RIGHT]] * 10, [[0], [0]] * 10))
    assert row(table, "end", "front_boundary") == (20, 20)
    assert table.largest.by == "cube"


def test_largest_failure_weighs_count_and_rate(make_episodes):
    """100 of 300 on the left and 30 of 40 on the right are 130 of 340 that are as far aside."""
    sides = [[LEFT]] * 300 + [[RIGHT]] * 40 + [[AHEAD]] * 660
    hits = [[i >= 100] for i in range(300)] + [[i >= 30] for i in range(40)] + [[1]] * 660
    largest = failure_table(make_episodes(sides, hits)).largest
    assert (largest.by, largest.failed, largest.episodes) == ("sideways", 130, 340)


def test_failures_of_another_task():
    """Posts: the second episode touches the first post, which stands to the right."""
    goals = Goals(
        reached=torch.tensor([[True, True], [False, False], [True, False]]),
        stratum=torch.tensor([[0, 1], [1, 0], [0, 0]]),
        world=torch.zeros(3, 1),
    )
    ends = torch.tensor([End.THROUGH, End.TOUCHED, End.TIME])
    table = failure_table(CompleteEpisodes(Posts(), goals, ends, torch.tensor([7, 2, 12])))
    assert [(r.by, r.value) for r in table.rows] == [
        ("side", "left"), ("side", "right"), ("end", "touched"), ("end", "time"),
    ]  # fmt: skip
    assert row(table, "side", "left") == (2, 1)
    assert row(table, "side", "right") == (2, 1)
    assert row(table, "end", "touched") == row(table, "end", "time") == (3, 1)
    assert table.largest.by == "side"  # of the ends, time is what is expected


def test_all_goals_without_success_is_a_failure():
    goals = Goals(
        reached=torch.ones(2, 2, dtype=torch.bool),
        stratum=torch.tensor([[0, 1], [0, 1]]),
        world=torch.zeros(2, 1),
    )
    ends = torch.tensor([End.THROUGH, End.TOUCHED])
    table = failure_table(CompleteEpisodes(Posts(), goals, ends, torch.tensor([7, 7])))
    assert table.bound == proportion(1, 2)
    assert row(table, "end", "touched") == (2, 1)
    assert (table.largest.by, table.largest.value) == ("end", "touched")
