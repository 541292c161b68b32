"""Two programs that differ by what is known, on pictures of flights."""

import math

import pytest
import torch

from drone_rl.envs import on_pixels
from drone_rl.evaluation import agreement
from tests.continuous import make_policy, make_worlds


@pytest.fixture
def flown(make_pipeline):
    """Worlds, a policy, and the same policy as a function of frames."""
    env, actor = make_pipeline(8, seed=3)
    network, transform = actor.module[0].module, on_pixels(env.transform)
    network.layers.logits.weight.data.mul_(100)  # so that pictures matter
    return env, actor, lambda frames: network(transform(frames)).softmax(-1)


def test_a_program_agrees_with_itself(flown):
    env, actor, same = flown
    shapes = []
    found = agreement(env, actor, lambda frames: (shapes.append(frames.shape), same(frames))[1], 5)
    assert (found.frames, found.actions_differ) == (40, 0)
    assert found.difference < 1e-6
    assert shapes == [(8, 25, 64, 3)] * 5


def test_programs_agree_on_what_speeds_are_for_the_most_part():
    env = make_worlds(4)
    network, actor = make_policy(env)
    transform, actions = on_pixels(env.transform), network.actions
    found = agreement(env, actor, lambda frames: actions.wish(network(transform(frames))), 5)
    env.close()
    assert (found.frames, found.actions_differ) == (20, 0) and found.difference < 1e-6


def test_the_greatest_difference_counts_once_and_anywhere(flown):
    env, actor, same = flown
    asked = []

    def other(frames):
        asked.append(same(frames))
        if len(asked) != 2:
            return asked[-1]
        probabilities = asked[-1].clone()
        probabilities[3, 1] += 0.25
        return probabilities

    found = agreement(env, actor, other, 3)
    assert found.difference == pytest.approx(0.25, abs=1e-6)
    moved = asked[1][3] + torch.tensor([0.0, 0.25, 0.0])
    assert found.actions_differ == int(moved.argmax() != asked[1][3].argmax())


def test_another_order_of_actions_differs_wherever_they_are_not_alike(flown):
    env, actor, same = flown
    found = agreement(env, actor, lambda frames: same(frames).roll(1, -1), 5)
    assert found.actions_differ == found.frames


def test_what_is_no_number_is_no_agreement(flown):
    env, actor, same = flown
    found = agreement(env, actor, lambda frames: same(frames) * math.nan, 2)
    assert math.isnan(found.difference)


def test_whoever_ends_an_episode_begins_another_and_is_asked_about_it(flown):
    """Flying left ends every episode after 27 steps, and 40 are flown."""
    env, actor, _ = flown
    network = actor.module[0].module
    network.layers.logits.weight.data.zero_()
    network.layers.logits.bias.data.copy_(torch.tensor([0.0, 99.0, 0.0]))
    seen = []

    def other(frames):
        seen.append(frames.clone())
        return torch.tensor([[0.0, 1.0, 0.0]]).expand(len(frames), 3)

    found = agreement(env, actor, other, 40)
    assert found.difference < 1e-6
    assert not torch.equal(seen[26], seen[27])
    level = env.base_env.worlds.task.settings.altitude
    assert level == env.base_env.worlds.state.body.position[0, 2]
    assert env.base_env.worlds.state.body.position[0, 1] == 40 - 27
