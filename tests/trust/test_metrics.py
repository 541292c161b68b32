import pytest
import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.sim.tasks import CollectCubes, Goals
from drone_rl.trust.metrics import summarise
from drone_rl.trust.results import GoalShare
from drone_rl.utils.intervals import mean_bounds, proportion


@pytest.fixture
def episodes():
    """Three episodes of two cubes; the last one never came to its second cube."""
    return CompleteEpisodes(
        task=CollectCubes(),
        goals=Goals(
            reached=torch.tensor([[True, True], [True, False], [False, False]]),
            stratum=torch.tensor([[0, 0], [0, 0], [2, -1]]),
            world=torch.tensor([[5.0], [2.0], [-4.0]]),
        ),
        end_reason=torch.tensor([1, 2, 4]),
        length=torch.tensor([10, 20, 60]),
    )


def test_summary_by_hand(episodes):
    summary = summarise(episodes)
    assert summary.success == proportion(1, 3)
    assert summary.mean_goals == 1.0
    shares = summary.shares
    assert shares["all"] == GoalShare(**dict(mean_bounds([1.0, 0.5, 0.0])), goals=6)
    assert shares["left"] == GoalShare(
        **dict(mean_bounds([1.0, 0.5])), goals=4
    )  # an episode counts once
    assert shares["right"] == GoalShare(**dict(mean_bounds([0.0])), goals=1)
    assert summary.never_reached == mean_bounds([0.0, 0.0, 0.5])
    ends = {name: end.successes for name, end in summary.ends.items()}
    none = {"side_boundary": 0, "lost_control": 0}
    assert ends == {"all_cubes": 1, "front_boundary": 1, "step_limit": 1, **none}
    assert (summary.mean_length, summary.max_length) == (30.0, 60)


def test_stratum_without_goals_has_no_rate(episodes):
    ahead = summarise(episodes).shares["ahead"]
    assert ahead.mean is None
    assert (ahead.lower95, ahead.upper95, ahead.count, ahead.goals) == (0, 1, 0, 0)


def test_intervals_count_episodes_not_goals():
    """All or nothing: three cubes an episode tell no more than one."""
    whole = torch.arange(100) < 90
    common = {"end_reason": torch.ones(100).long(), "length": torch.ones(100).long()}
    alike = [
        CompleteEpisodes(
            task=CollectCubes(),
            goals=Goals(
                reached=whole[:, None].expand(100, cubes),
                stratum=torch.zeros(100, cubes).long(),
                world=torch.zeros(100, 1),
            ),
            **common,
        )
        for cubes in (1, 3)
    ]
    one, three = (summarise(e).shares["left"] for e in alike)
    assert (one.lower95, one.upper95) == (three.lower95, three.upper95)
    assert one.lower95 < proportion(90, 100).lower95
