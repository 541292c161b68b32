"""What rounding and batches can change in episodes, with networks made by hand."""

import dataclasses

import pytest
import torch
from tensordict import TensorDict

import drone_rl
from drone_rl.collectors.complete_episodes import StepLog, run_episodes
from drone_rl.config.transforms import Gray, Stack
from drone_rl.policies.external_network import ExternalNetwork
from drone_rl.policies.external_policy import policy_from
from drone_rl.policies.rounding import Decisions
from drone_rl.sim.actions import MOVES, Move
from drone_rl.trust import rounding_sensitivity
from drone_rl.trust.outcomes import OutcomeSet
from drone_rl.trust.rounding_sensitivity import (
    check_rounding,
    compare_implementations,
    require_same_in_any_batch,
)
from drone_rl.utils.errors import InputError

EPISODES = 20


def examined(policy, is_compiled=True):
    with policy.flying(EPISODES, seed=1) as (env, actor):
        state, log = env.base_env.state_dict(), StepLog()
        flown = run_episodes(env, actor, EPISODES, is_compiled=is_compiled, log=log)
        env.base_env.load_state_dict(state)
        how = check_rounding if is_compiled else compare_implementations
        count = (EPISODES,) if is_compiled else ()
        return how(env, actor, *count, greedy=flown, log=log), flown, log


def with_unit(by_unit):
    """The shipped policy with the hidden unit 2^24 + 1 - 2^24 added to the logit of a left turn."""
    from benchmarks.gamed_rounding import BIG, parameter, widened
    from drone_rl.policies.zoo import parse

    described, weights = widened()
    unit = parameter(weights, "fc1.weight")[-1]
    unit[-56], unit[-55] = BIG, -BIG
    parameter(weights, "fc1.bias")[-1] = 1.0
    parameter(weights, "logits.weight")[Move.LEFT, -1] = by_unit
    policy = drone_rl.load_policy("good")
    return dataclasses.replace(
        policy, description=parse(described), state={**policy.state, "policy": weights}
    )


_run_checked = rounding_sensitivity._run_checked


def without_fragile_frames(*given):
    """Runs episodes as `_run_checked`, with a bound that misses everything."""
    checked, actions = _run_checked(*given)
    none = [torch.zeros_like(of) for of in checked.fragile]
    return dataclasses.replace(checked, fragile=none), actions


def test_an_honest_policy_takes_the_same_actions_in_both_implementations():
    found, flown, log = examined(drone_rl.load_policy("good"))
    assert log.implementation == "fused kernel"
    assert [len(a) for a in log.actions] == flown.length.tolist()
    assert (found.compared, found.compared_episodes, found.unexplained) == ("PyTorch", EPISODES, 0)
    assert found.frames == int(flown.length.sum())
    assert not found.is_excessive
    assert found.arithmetic == "float32 on cpu, fused kernel"


def test_a_policy_that_acts_by_the_order_of_sums_is_found():
    found, _, _ = examined(with_unit(1000.0))
    assert found.fragile == found.frames
    assert found.is_excessive
    assert found.differing == EPISODES
    assert found.unexplained == 0  # the bound knows


def test_evaluations_compare_with_the_fused_kernel():
    found, _, log = examined(drone_rl.load_policy("good"), is_compiled=False)
    assert (log.implementation, found.compared) == ("PyTorch", "fused kernel")
    assert found.differing == 0
    found, _, _ = examined(with_unit(1000.0), is_compiled=False)
    assert (found.differing, found.unexplained) == (EPISODES, 0)


def test_differences_between_implementations_need_an_explanation(monkeypatch):
    monkeypatch.setattr(rounding_sensitivity, "_run_checked", without_fragile_frames)
    found, _, _ = examined(with_unit(1000.0), is_compiled=False)
    assert (found.compared, found.differing) == ("fused kernel", EPISODES)
    assert found.unexplained == EPISODES


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
        examined(policy, is_compiled=False)


def test_a_callable_that_acts_by_the_frame_passes():
    found, _, _ = examined(policy_from(lambda x: x[:, 0, 10:13, 5] * 100), is_compiled=False)
    assert not found.is_bound
    assert found.unexplained == 0


def test_frames_are_tried_in_batches_of_many_sizes():
    def logits(pixels):
        return pixels.flatten(1)[:, :3] + (len(pixels) == 57)

    frames = torch.rand(9, 1, 1, 3)
    with pytest.raises(InputError, match="in a batch of 57: they differ by 1"):
        require_same_in_any_batch(ExternalNetwork(logits, (1, 1, 3), MOVES), frames, range(1, 65))


def test_a_fragile_frame_explains_no_earlier_difference(make_episodes):
    ends = make_episodes([[0], [1], [0]], [[True], [True], [True]])
    fragile = [torch.tensor(of) for of in ([False, True, False], [True, False], [False, False])]
    checked = rounding_sensitivity._Checked(ends, fragile, None)
    assert checked.unexplained({0: 0}) == checked.unexplained({2: 1}) == 1
    assert checked.unexplained({0: 1}) == checked.unexplained({0: 2}) == 0
    assert checked.unexplained({0: 0, 1: 1, 2: 0}) == 2


def test_outcomes_of_several_batches_are_numbered_by_episode(make_episodes):
    ends = make_episodes([[0], [1]], [[True], [False]])
    found = OutcomeSet(ends, torch.tensor([1, 0]), torch.tensor([False, True]))
    fragile = [torch.tensor([False])] * 8
    batches = [(0, found, torch.tensor([0, 2])), (4, found, torch.tensor([1, 3]))]
    outcomes = rounding_sensitivity._Checked(ends, fragile, batches).outcomes()
    assert outcomes.owner.tolist() == [2, 0, 7, 5]
    assert outcomes.is_open.nonzero()[:, 0].tolist() == [2, 7]
    assert outcomes.episodes.success.tolist() == [1, 0, 1, 0]


@pytest.fixture
def with_fragile_starts(monkeypatch):
    """Outcomes of a policy of two frames, which flies straight on after a fragile first frame.

    They are found even if all episodes have such a frame.
    """
    monkeypatch.setattr(rounding_sensitivity, "MAX_FRAGILE_EPISODES", 1.0)

    def with_fragile_starts(possible):
        sizes = [0]

        def decide(pixels):
            sizes.append(len(pixels))  # falls as episodes end
            is_first = sizes[-1] > sizes[-2]
            outputs = torch.tensor([[3.0, 2.0, 1.0]]).repeat(len(pixels), 1)
            is_possible = torch.tensor(possible if is_first else [True, False, False])
            return Decisions(outputs, is_possible.repeat(len(pixels), 1))

        policy = policy_from(lambda x: x[:, 0, 10:13, 5], transforms=[Gray(), Stack(N=2)])
        with policy.flying(EPISODES, seed=1) as (env, actor):
            checked, _ = rounding_sensitivity._run_checked(env, decide, actor.network, EPISODES)
        assert [of.nonzero().tolist() for of in checked.fragile] == [[[0]]] * EPISODES
        return checked.outcomes()

    return with_fragile_starts


def test_the_other_action_of_a_single_fragile_frame_is_followed(with_fragile_starts):
    found = with_fragile_starts([True, True, False])
    assert not found.is_open.any()
    assert found.owner.tolist() == list(range(EPISODES))


def test_a_frame_with_three_possible_actions_leaves_the_outcomes_open(with_fragile_starts):
    assert with_fragile_starts([True, True, True]).is_open.all()


def test_the_other_action_is_the_possible_one_even_if_another_has_a_greater_logit():
    network = ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 1, 3), MOVES)
    outputs = torch.tensor([[3.0, 2.0, 1.0], [3.0, 2.0, 1.0]])
    possible = torch.tensor([[True, False, True], [True, True, True]])
    actor = rounding_sensitivity._CheckingActor(
        lambda _: Decisions(outputs, possible), network, is_contrary=True
    )
    given = TensorDict({"pixels": torch.zeros(2, 1, 1, 3)}, [2])
    assert actor(given)["action"].tolist() == [2, 0]
