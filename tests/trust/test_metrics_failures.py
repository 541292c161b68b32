import enum

import pytest
import torch

from drone_rl.collectors.complete_episodes import Episodes
from drone_rl.config import TaskSettings
from drone_rl.sim.tasks import CollectCubes, Goals
from drone_rl.sim.tasks.collect_cubes import EndReason, Side
from drone_rl.trust.metrics import failure_table
from drone_rl.utils.intervals import proportion
from tests.second_task import End, Posts

LEFT, AHEAD, RIGHT = Side


def row(table, by, value):
    (found,) = [r for r in table["rows"] if (r["by"], r["value"]) == (by, value)]
    return found["episodes"], found["failed"]


@pytest.fixture
def episodes(make_episodes):
    """Fails at the second, a cube on the right; at the first, on the left; at none."""
    sides = [[LEFT, RIGHT, LEFT], [LEFT, -1, -1], [AHEAD, AHEAD, RIGHT]]
    hits = [[1, 0, 0], [0, 0, 0], [1, 1, 1]]
    return make_episodes(sides, hits, end=[EndReason.FRONT_BOUNDARY, EndReason.SIDE_BOUNDARY, 0])


def test_an_episode_fails_once_at_its_first_miss(episodes):
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
    assert table["bound"] == proportion(2, 3)
    assert table["largest"]["value"] == "1.65 to 4 m"


def test_intervals_of_all_rows_hold_at_once(episodes):
    rows = failure_table(episodes)["rows"]
    assert len(rows) == 3 + 3 + 4 + 4
    exact = proportion(1, 2, 1 - 0.05 / len(rows))
    second = next(r for r in rows if r["value"] == "second")
    assert (second["lower95"], second["upper95"]) == (exact["lower95"], exact["upper95"])
    assert second["share"] == 0.5


def test_heights_are_told_where_they_differ(make_episodes):
    task = TaskSettings(num_cubes=1, vertical_bound=1.2, altitude=5.0)
    episodes = make_episodes([[AHEAD]] * 4, [[0], [1], [1], [1]], task=CollectCubes(task))
    episodes.goals.height = torch.tensor([[1.0], [0.41], [0.39], [-0.5]]).double()
    table = failure_table(episodes)
    assert row(table, "height", "higher") == (2, 1)
    assert row(table, "height", "level") == (1, 0)
    assert row(table, "height", "lower") == (1, 0)
    level = failure_table(make_episodes([[AHEAD]], [[0]]))
    assert not [r for r in level["rows"] if r["by"] == "height"]


def test_nothing_failed(make_episodes):
    table = failure_table(make_episodes([[LEFT, RIGHT]] * 400, [[1, 1]] * 400))
    assert table["largest"] is None
    assert table["bound"]["upper95"] == pytest.approx(1 - 0.025 ** (1 / 400))


def test_the_largest_explains_most_failures_and_holds_little_else(make_episodes):
    """All failures are at first cubes, and all of these ahead: every second one."""
    sides = [[AHEAD if i < 50 else LEFT, RIGHT] for i in range(100)]
    hits = [[i >= 25, i >= 25] for i in range(100)]
    largest = failure_table(make_episodes(sides, hits))["largest"]
    assert (largest["by"], largest["value"]) == ("side", "ahead")
    assert (largest["failed"], largest["episodes"]) == (25, 50)


def test_flying_on_behind_a_missed_cube_is_no_news(make_episodes):
    table = failure_table(make_episodes([[LEFT], [RIGHT]] * 10, [[0], [0]] * 10))
    assert row(table, "end", "front_boundary") == (20, 20)
    assert table["largest"]["by"] == "cube"


def test_a_few_sure_failures_are_not_the_largest(make_episodes):
    """Three of four episodes fail at their second cube; all of the five that meet one ahead do."""
    sides = [[LEFT, AHEAD if i < 5 else RIGHT] for i in range(100)]
    hits = [[1, i >= 75] for i in range(100)]
    largest = failure_table(make_episodes(sides, hits))["largest"]
    assert (largest["by"], largest["value"]) != ("side", "ahead")
    assert largest["failed"] >= 70


def test_a_third_of_the_bound_is_still_level(make_episodes):
    task = TaskSettings(num_cubes=1, vertical_bound=0.75)
    episodes = make_episodes([[AHEAD]] * 4, [[0], [1], [1], [1]], task=CollectCubes(task))
    episodes.goals.height = torch.tensor([[0.25], [-0.25], [0.26], [-0.26]]).double()
    table = failure_table(episodes)
    assert row(table, "height", "level") == (2, 1)
    assert row(table, "height", "higher") == row(table, "height", "lower") == (1, 0)


def test_the_largest_weighs_many_failures_against_a_large_share(make_episodes):
    """100 of 300 on the left and 30 of 40 on the right are 130 of 340 that are as far aside."""
    sides = [[LEFT]] * 300 + [[RIGHT]] * 40 + [[AHEAD]] * 660
    hits = [[i >= 100] for i in range(300)] + [[i >= 30] for i in range(40)] + [[1]] * 660
    largest = failure_table(make_episodes(sides, hits))["largest"]
    assert (largest["by"], largest["failed"], largest["episodes"]) == ("sideways", 130, 340)


def test_another_task_has_classes_and_ends_of_its_own():
    """Posts: the second episode touches the first post, which stands to the right."""
    goals = Goals(
        reached=torch.tensor([[True, True], [False, False], [True, False]]),
        stratum=torch.tensor([[0, 1], [1, 0], [0, 0]]),
        world=torch.zeros(3, 1),
    )
    ends = torch.tensor([End.THROUGH, End.TOUCHED, End.TIME])
    table = failure_table(Episodes(Posts(), goals, ends, torch.tensor([7, 2, 12])))
    assert [(r["by"], r["value"]) for r in table["rows"]] == [
        ("side", "left"), ("side", "right"), ("end", "touched"), ("end", "time"),
    ]  # fmt: skip
    assert row(table, "side", "left") == (2, 1)
    assert row(table, "side", "right") == (2, 1)
    assert row(table, "end", "touched") == row(table, "end", "time") == (3, 1)
    assert table["largest"]["by"] == "side"  # of the ends, time is what is expected


def test_the_expected_end_is_the_largest_if_no_class_has_the_missed_goals():
    """Both episodes end before the post that they miss comes up, so that it has no side."""
    goals = Goals(
        reached=torch.tensor([[True, False], [True, False]]),
        stratum=torch.tensor([[0, -1], [1, -1]]),
        world=torch.zeros(2, 1),
    )
    ends = torch.tensor([End.TIME, End.TIME])
    largest = failure_table(Episodes(Posts(), goals, ends, torch.tensor([12, 12])))["largest"]
    assert (largest["by"], largest["value"], largest["failed"]) == ("end", "time", 2)


def test_a_class_with_the_name_of_the_expected_end_can_be_the_largest(make_episodes):
    class Named(CollectCubes):
        def classes(self, goals):
            yield "side", "front_boundary", goals.stratum >= 0

    table = failure_table(make_episodes([[LEFT]] * 4, [[0]] * 4, task=Named()))
    assert table["largest"]["by"] == "side"


def test_all_goals_without_success_are_a_failure_by_the_end():
    goals = Goals(
        reached=torch.ones(2, 2, dtype=torch.bool),
        stratum=torch.tensor([[0, 1], [0, 1]]),
        world=torch.zeros(2, 1),
    )
    ends = torch.tensor([End.THROUGH, End.TOUCHED])
    table = failure_table(Episodes(Posts(), goals, ends, torch.tensor([7, 7])))
    assert table["bound"] == proportion(1, 2)
    assert row(table, "end", "touched") == (2, 1)
    assert (table["largest"]["by"], table["largest"]["value"]) == ("end", "touched")


def test_a_task_may_lack_the_expected_end():
    class Only(enum.IntEnum):
        RUNNING = 0
        TIME = 1

    class Hover(Posts):
        ends, success_end, truncation, expected_end = Only, Only.TIME, Only.TIME, 2

    goals = Goals(torch.ones(2, 2).bool(), torch.zeros(2, 2).long(), torch.zeros(2, 1))
    table = failure_table(Episodes(Hover(), goals, torch.ones(2).long(), torch.tensor([9, 9])))
    assert table["expected_end"] is None and table["largest"] is None
