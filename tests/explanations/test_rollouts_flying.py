import pytest
import torch
from torch import nn
from torchrl.envs import CatFrames

from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.explanations.rollouts import run_to_end
from drone_rl.explanations.scenes import Scenes, place_target
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import EndReason

F, L, R = Move.FORWARD, Move.LEFT, Move.RIGHT


class Always(nn.Module):
    """Takes given actions one after the other, the last of them for ever; the same everywhere."""

    def __init__(self, *actions):
        super().__init__()
        self.actions, self.seen = list(actions), []

    def forward(self, pictures):
        self.seen.append(pictures)
        action = self.actions[min(len(self.seen), len(self.actions)) - 1]
        return 9.0 * nn.functional.one_hot(torch.full((len(pictures),), int(action)), 3).float()


@pytest.fixture
def scenes(make_pipeline):
    return Scenes(make_pipeline(num_envs=2)[0])


def test_straight_on_collects_what_it_touches(scenes):
    reach = scenes.worlds.task.settings.touch_distance  # 1.65 m
    starts = place_target(
        scenes, torch.tensor([5.0, 5.0, 5.0]), torch.tensor([0, reach, reach + 0.1])
    )
    network = Always(F)
    ends = run_to_end(scenes, network, starts)
    assert ends.collected[:, 0].tolist() == [True, True, False]
    assert ends.steps.tolist() == [4, 4, 6]  # touches at 3.35 m, and has passed at 6 m
    assert [len(seen) for seen in network.seen] == [3, 3, 3, 3, 1, 1]  # what is settled rests
    assert starts.steps.tolist() == [0, 0, 0]  # where they started is left as it was


def test_one_that_turns_back_is_in_a_loop_for_ever(scenes):
    network = Always(F, L, R, F)
    ends = run_to_end(
        scenes, network, place_target(scenes, torch.tensor([9.0]), torch.tensor([0.0]))
    )
    assert ends.end_reason.tolist() == [EndReason.STEP_LIMIT] and not ends.collected.any()
    assert len(network.seen) == 3


def test_turning_the_same_way_is_no_loop(scenes):
    ends = run_to_end(
        scenes, Always(L, L, L, F), place_target(scenes, torch.tensor([4.0]), torch.tensor([4.0]))
    )
    assert ends.collected[0, 0]


def test_turning_back_after_a_cube_is_no_loop(scenes):
    starts = place_target(scenes, torch.tensor([1.0]), torch.tensor([2.0]))
    starts.passed[:, 1] = False  # a second cube, 9 m on
    starts.cubes[:, 1, :2] = torch.tensor([10.0, 0.0])
    ends = run_to_end(scenes, Always(L, R, F), starts)  # the first step left touches the first cube
    assert ends.collected[0, :2].tolist() == [True, True]


def test_leaving_the_field_ends_a_flight(scenes):
    ends = run_to_end(
        scenes, Always(L), place_target(scenes, torch.tensor([9.0]), torch.tensor([-3.0]))
    )
    assert ends.end_reason.tolist() == [EndReason.SIDE_BOUNDARY]
    assert ends.steps.tolist() == [27]  # 26 m is the bound


def test_a_policy_that_remembers_sees_the_frames_before_and_may_turn_back():
    stack = CatFrames(N=2, dim=-3, in_keys=["pixels"])
    task = TaskSettings(num_cubes=1, step_limit=20)
    env = with_transforms(DroneEnv(1, task), [GrayPixels(), stack])
    scenes, network = Scenes(env), Always(F, L, R, F)
    starts = place_target(scenes, torch.tensor([9.0]), torch.tensor([0.0]))
    ends = run_to_end(scenes, network, starts)
    env.close()
    assert scenes.memory == 1 and ends.collected[0, 0]
    first, second = network.seen[:2]
    assert torch.equal(first[:, 0], first[:, 1])  # a flight starts with a still
    assert torch.equal(second[:, 0], first[:, 1]) and not torch.equal(second[:, 1], first[:, 1])
