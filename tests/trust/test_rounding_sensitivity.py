"""What rounding and batches can change in episodes, with networks made by hand."""

import dataclasses
from types import SimpleNamespace

import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import rollout
from drone_rl.policies.external_network import ExternalNetwork
from drone_rl.policies.external_policy import policy_from
from drone_rl.sim.actions import MOVES, Move
from drone_rl.trust.rounding_sensitivity import (
    _count_unexplained,
    _first_difference,
    _other_outcome,
    check_rounding,
    require_same_in_any_batch,
)
from drone_rl.utils.errors import InputError

EPISODES = 20


def examined(policy):
    with policy.flying(EPISODES, seed=1) as (env, actor):
        state = env.base_env.state_dict()
        flown = rollout(actor, env, EPISODES, compiled=True)
        env.base_env.load_state_dict(state)
        return check_rounding(env, actor, EPISODES, flown), flown


def with_unit(by_unit):
    """The shipped policy with the hidden unit 2^24 + 1 - 2^24 added to the logit of a left turn."""
    from benchmarks.gamed_rounding import BIG, parameter, widened

    described, weights = widened()
    unit = parameter(weights, "fc1.weight")[-1]
    unit[-56], unit[-55] = BIG, -BIG
    parameter(weights, "fc1.bias")[-1] = 1.0
    parameter(weights, "logits.weight")[Move.LEFT, -1] = by_unit
    policy = drone_rl.load_policy("good")
    state = policy.state.replace(description=described, weights=weights)
    return dataclasses.replace(policy, description=described, state=state)


def test_an_honest_policy_takes_the_same_actions_in_both_implementations():
    found, flown = examined(drone_rl.load_policy("good"))
    assert flown.implementation == "fused kernel"
    assert (found.compared, found.compared_episodes, found.unexplained) == ("PyTorch", EPISODES, 0)
    assert found.frames == int(flown.length.sum())
    assert not found.excessive
    assert found.arithmetic == "float32 on cpu, fused kernel"


def test_a_policy_that_acts_by_the_order_of_sums_is_found():
    found, _ = examined(with_unit(1000.0))
    assert found.fragile == found.frames
    assert found.excessive
    assert found.differing == EPISODES
    assert found.unexplained == 0  # the bound knows


@pytest.mark.parametrize("kind", ["alone", "first", "calls"])
def test_callables_that_act_by_more_than_the_frame_are_refused(kind):
    calls = 0

    def logits(pixels):
        nonlocal calls
        calls += 1
        made = torch.tensor([1.0, 0.0, 0.0]).repeat(len(pixels), 1)
        if (kind == "alone" and len(pixels) == 1) or (kind == "calls" and calls > 200):
            made[:, Move.LEFT] = 2.0
        if kind == "first":
            made[0, Move.LEFT] = 2.0
        return made

    policy = policy_from(lambda x: x[:, 0, 10:13, 5], name="logits")
    policy = dataclasses.replace(policy, logits=logits)  # `policy_from` would refuse some
    with pytest.raises(InputError, match=r"policy=logits depends on more than the frame"):
        examined(policy)


def test_a_callable_that_acts_by_the_frame_passes():
    found, _ = examined(policy_from(lambda x: x[:, 0, 10:13, 5] * 100))
    assert not found.bound
    assert found.unexplained == 0


def test_frames_are_tried_in_batches_of_many_sizes():
    def logits(pixels):
        return pixels.flatten(1)[:, :3] + (len(pixels) == 57)

    frames = torch.rand(9, 1, 1, 3)
    with pytest.raises(InputError, match="in a batch of 57: they differ by 1"):
        require_same_in_any_batch(ExternalNetwork(logits, (1, 1, 3), MOVES), frames, range(1, 65))


@pytest.mark.parametrize(
    ("steps", "unexplained"), [([0, None, 1], 2), ([1, None, None], 0), ([2], 0)]
)
def test_a_fragile_frame_explains_only_later_differences(steps, unexplained):
    fragile = [torch.tensor(of) for of in ([False, True, False], [True, False], [False, False])]
    assert _count_unexplained(steps, fragile) == unexplained


@pytest.mark.parametrize(
    ("one", "other", "step"),
    [
        ([1, 2, 3], [1, 2, 3], None),
        ([1, 2, 3], [1, 0, 0], 1),
        ([1, 2, 3], [1, 2], 2),  # the shorter one ended after the same actions
        ([1], [1, 2], 1),
        ([0, 2], [1], 0),
    ],
)
def test_first_different_action(one, other, step):
    assert _first_difference(torch.tensor(one), torch.tensor(other)) == step


def episodes(reasons, reached, lengths):
    goals = SimpleNamespace(reached=torch.tensor(reached))
    made = {"end_reason": torch.tensor(reasons), "length": torch.tensor(lengths)}
    return SimpleNamespace(goals=goals, **made)


def test_outcomes_differ_by_end_or_by_goals_reached():
    one = episodes([1, 1, 1], [[True], [True], [True]], [5, 6, 7])
    other = episodes([1, 2, 1], [[True], [True], [False]], [9, 9, 9])
    assert [_other_outcome(one, other, i) for i in range(3)] == [None, 6, 7]
