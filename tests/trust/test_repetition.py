"""Repeated episodes of policies that act by their images, or by something else."""

import pytest
import torch

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import TaskSettings
from drone_rl.config.inputs import Goal, GrayImage, describe_inputs
from drone_rl.envs import DroneEnv, GrayPixels
from drone_rl.envs.rollout import Act
from drone_rl.policies import ImageNetwork, make_actor
from drone_rl.sim.actions import Move
from drone_rl.trust.repetition import (
    InGroups,
    WithOtherInputs,
    exchange_images,
    exchange_inputs,
    repeat,
)
from drone_rl.utils.seeding import Stream
from tests.trust.subjects import SMALL, TASK, Blind, Steering

EPISODES = 60


@pytest.fixture
def make_run():
    """Episodes of a network or an agent, with the environments in the state before them."""

    def run(policy, task=TASK, episodes=EPISODES, num_envs=20, inputs=None):
        transforms = [GrayPixels()]
        how = {"transforms": transforms, "inputs": inputs, "seed": 3, "stream": Stream.REPORT}
        env = DroneEnv(num_envs, task, SMALL, **how)
        actor = make_actor(policy, env.action_spec) if isinstance(policy, ImageNetwork) else policy
        state = env.state_dict()
        greedy = rollout(actor, env, episodes)
        env.load_state_dict(state)
        return env, actor, greedy

    return run


def test_a_policy_that_acts_by_its_images_is_repeatable_and_uses_its_camera(make_run):
    run = make_run(Steering())
    found = repeat(*run)
    assert (found.episodes, [one.different for one in found.runs]) == (50, [0, 0])
    assert found.is_same and found.successes > 45
    camera = exchange_images(*run)
    assert camera.is_used and camera.own > 0.95 and camera.exchanged < 0.7
    again = exchange_images(*run)
    assert again == camera, "the environments keep their state"


class ByBatch(Steering):
    """Steers in batches, and flies to the left one at a time."""

    def forward(self, pixels):
        logits = super().forward(pixels)
        logits[..., Move.LEFT] += 10.0 * (len(pixels) == 1)
        return logits


def test_a_policy_that_acts_by_the_size_of_the_batch_is_found(make_run):
    found = repeat(*make_run(ByBatch()))
    assert not found.is_same and found.worst.how == "one environment at a time"
    assert found.worst.successes == 0 < found.successes


class ByPlace(Steering):
    """Flies to the left in the first place of a batch."""

    def forward(self, pixels):
        logits = super().forward(pixels)
        logits[:1, Move.LEFT] += 10.0
        return logits


class ByCalls(Steering):
    """Flies to the left after so many calls."""

    def __init__(self):
        super().__init__()
        self.calls = 0

    def forward(self, pixels):
        self.calls += 1
        logits = super().forward(pixels)
        logits[..., Move.LEFT] += 10.0 * (self.calls > 400)
        return logits


class ByChance(Steering):
    """Flies to the left in about half of the steps, by chance."""

    def forward(self, pixels):
        logits = super().forward(pixels)
        logits[torch.rand(len(pixels)) < 0.45, Move.LEFT] += 10.0
        return logits


@pytest.mark.parametrize("make", [ByPlace, ByCalls, ByChance])
def test_policies_that_act_by_more_than_their_images_are_found(make_run, make):
    assert not repeat(*make_run(make())).is_same


class InFirstPlaces(Steering):
    """Flies to the left in the first 50 places of a batch."""

    def forward(self, pixels):
        logits = super().forward(pixels)
        logits[:50, Move.LEFT] += 10.0
        return logits


def test_a_policy_that_is_spoiled_in_the_first_places_of_a_large_batch_is_found(make_run):
    found = repeat(*make_run(InFirstPlaces(), episodes=200, num_envs=100))
    assert not found.is_same and found.successes > 0
    assert found.worst.successes == 0, "it is always in the first places when run again"


@pytest.mark.parametrize(("num_envs", "sizes"), [(1, ["one"]), (60, ["one", "8"])])
def test_episodes_of_any_batch_are_repeated_with_the_stated_sizes(make_run, num_envs, sizes):
    found = repeat(*make_run(Steering(), num_envs=num_envs))
    assert [run.how.split()[0] for run in found.runs] == sizes
    assert [run.different for run in found.runs] == [0] * len(sizes)


def test_an_episode_without_another_one_says_nothing_about_the_camera(make_run):
    alone = exchange_images(*make_run(Steering(), episodes=4, num_envs=1))
    assert alone.exchanged is None and alone.is_used is None
    assert exchange_images(*make_run(Steering(), episodes=21, num_envs=20)).success.count == 20
    assert exchange_images(*make_run(Steering(), episodes=22, num_envs=20)).success.count == 22


def test_a_blind_policy_does_not_use_its_camera(make_run):
    wide = TaskSettings(
        num_cubes=1, first_distance=8.0, front_margin=4.0, cube_size=4.0, lateral_bound=0.5
    )
    camera = exchange_images(*make_run(Blind(), wide))
    assert camera.own == camera.exchanged == 1.0
    assert camera.is_used is False


class OneSided(Steering):
    """Never flies to the right."""

    def forward(self, pixels):
        logits = super().forward(pixels)
        logits[..., Move.RIGHT] -= 10.0
        return logits


def test_a_policy_that_hardly_ever_succeeds_uses_its_camera_if_goals_depend_on_it(make_run):
    three = TASK.replace(num_cubes=3)
    camera = exchange_images(*make_run(OneSided(), three, 200))
    assert camera.own < 0.3 and camera.is_used
    assert exchange_images(*make_run(Blind(), three, 200)).is_used is None


class Noting:
    """Flies straight on, and notes what it observes of which environments."""

    def __init__(self):
        self.seen = []

    def act(self, context):
        self.seen.append((context.rows.tolist(), context.observe().flatten(1).sum(-1)))
        return Act(torch.zeros(len(context.rows), dtype=torch.long))


def test_groups_of_environments_share_calls(make_run):
    whole, grouped = Noting(), Noting()
    make_run(whole, episodes=20)
    make_run(InGroups(grouped, 8), episodes=20)
    assert [rows for rows, _ in grouped.seen[:3]] == [
        [*range(8)], [*range(8, 16)], [*range(16, 20)]
    ]  # fmt: skip
    first = torch.cat([seen for _, seen in grouped.seen[:3]])
    assert torch.equal(first, whole.seen[0][1])


def test_other_images_are_those_of_the_next_environment_and_its_last_ones(make_run):
    whole, other = Noting(), Noting()
    make_run(whole, episodes=20)
    make_run(WithOtherInputs(other), episodes=20)
    last = torch.zeros(20)
    for (rows, own), (same_rows, seen) in zip(whole.seen, other.seen, strict=True):
        assert rows == same_rows
        last[rows] = own
        assert torch.equal(seen, last[[(row + 1) % 20 for row in rows]])


class ToGoal(ImageNetwork):
    """Goes to the side of its goal, and has an image that it does not use."""

    in_keys = ("gray", "goal")

    def __init__(self, weight=0.0):
        super().__init__()
        self.weight = weight

    def forward(self, gray, goal):  # pyright: ignore[reportIncompatibleMethodOverride]
        side = goal[..., 1] + self.weight * gray.flatten(1).mean(-1)
        return torch.stack([0.3 - side.abs(), side, -side], -1)


@pytest.mark.parametrize("weight", [0.0, 0.01])
def test_an_input_is_ignored_only_if_no_action_changes_with_it(make_run, weight):
    inputs = describe_inputs({"gray": GrayImage(), "goal": Goal()}, SMALL, ())
    env, actor, greedy = make_run(ToGoal(weight), inputs=inputs)
    uses = exchange_inputs(env, actor, greedy)
    assert uses["goal"].own > 0.95 and uses["goal"].exchanged < 0.7
    assert not (uses["goal"].is_ignored or uses["goal"].is_dispensable)
    assert uses["gray"].is_dispensable and uses["gray"].success.mean == pytest.approx(0, abs=0.05)
    assert uses["gray"].is_ignored == (weight == 0.0)
    steps = int(greedy.length.sum())
    assert uses["gray"].changed.trials == 3 * steps  # of three other environments
