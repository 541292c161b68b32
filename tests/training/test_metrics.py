import enum

import pytest
import torch
from tensordict import TensorDict

from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.training.metrics import batch_metrics, episode_rewards, running_mean
from drone_rl.utils.errors import InputError


def test_running_mean_matches_hand_computed_value():
    assert running_mean(0.0, torch.tensor([1.0, 2.0]), 0.9) == pytest.approx(0.29)


def test_episode_rewards_and_batch_metrics_match_hand_computed_values():
    batch = TensorDict(
        {
            "next": {
                "reward": torch.tensor([0.0, 1.0, 1.0])[:, None],
                "done": torch.tensor([0, 1, 1]).bool()[:, None],
                "info": {"end_reason": torch.tensor([0, 2, 1])[:, None]},
            }
        },
        [3],
    )
    assert episode_rewards(batch).tolist() == [1.0, 1.0]
    assert batch_metrics(batch, CubesEnd) == {
        "train/reward": 1.0,
        "train/length": 1.5,
        "end/all_cubes": 0.5,
        "end/front_boundary": 0.5,
        "end/side_boundary": 0.0,
        "end/step_limit": 0.0,
        "end/lost_control": 0.0,
    }


def make_batch(episodes):
    reward = torch.tensor([float(r) for episode in episodes for r in episode])[:, None]
    done = torch.zeros(len(reward), 1, dtype=torch.bool)
    done[torch.tensor([len(e) for e in episodes]).cumsum(0) - 1] = True
    return TensorDict({"next": {"reward": reward, "done": done}}, [len(reward)])


class End(enum.IntEnum):
    FLYING = 0
    THROUGH = 2
    LOST = 3


def test_end_metrics_are_those_of_the_task():
    """Three episodes: two end for one reason, one for the other."""
    batch = make_batch([[0, 1], [1], [0]])
    batch["next", "info"] = TensorDict({"end_reason": torch.tensor([0, 2, 3, 2])[:, None]}, [4])
    metrics = batch_metrics(batch, End)
    shares = {k: v for k, v in metrics.items() if k.startswith("end/")}
    assert shares == {"end/through": pytest.approx(2 / 3), "end/lost": pytest.approx(1 / 3)}
    assert not any(name.startswith("end/") for name in batch_metrics(batch))


def test_partial_episodes_use_reward_sums():
    """Two environments, three steps: one episode began earlier, and one continues later."""
    batch = TensorDict(
        {
            "next": {
                "reward": torch.tensor([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])[..., None],
                "episode_reward": torch.tensor([[3.0, 3.0, 1.0], [0.0, 1.0, 1.0]])[..., None],
                "done": torch.tensor([[0, 1, 0], [0, 0, 1]]).bool()[..., None],
                "info": {"end_reason": torch.tensor([[0, 3, 0], [0, 0, 4]])[..., None]},
            }
        },
        [2, 3],
    )
    assert episode_rewards(batch).tolist() == [3.0, 1.0]
    metrics = batch_metrics(batch, CubesEnd)
    assert (metrics["train/reward"], metrics["train/length"]) == (2.0, 3.0)
    assert (metrics["end/side_boundary"], metrics["end/all_cubes"]) == (0.5, 0.0)
    del batch["next", "episode_reward"]
    with pytest.raises(InputError, match="RewardSum"):
        episode_rewards(batch)


def test_lengths_use_the_step_count():
    """In a batch of 4 frames, episodes of 7 and 2 steps end."""
    batch = make_batch([[0.0, 1.0], [0.0, 1.0]])
    batch["next", "episode_reward"] = torch.tensor([1.0, 2.0, 0.0, 1.0])[:, None]
    batch["next", "step_count"] = torch.tensor([6, 7, 1, 2])[:, None]
    assert batch_metrics(batch) == {"train/reward": 1.5, "train/length": 4.5}
    batch["next", "done"][:] = False
    assert all(value != value for value in batch_metrics(batch).values())  # NaN
