"""Greedy episodes from the same start, and where two of them part, by hand."""

from types import SimpleNamespace

import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import (
    StepLog,
    episode_batches,
    final_episodes,
    run_episodes,
)
from drone_rl.envs import base_env
from drone_rl.trust.rollouts import first_difference, only_index, outcome_difference


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
def test_episodes_part_at_the_first_action_that_differs(one, other, step):
    assert first_difference(torch.tensor(one), torch.tensor(other)) == step


def episodes(reasons, reached, lengths):
    goals = SimpleNamespace(reached=torch.tensor(reached))
    made = {"end_reason": torch.tensor(reasons), "length": torch.tensor(lengths)}
    return SimpleNamespace(goals=goals, **made)


def test_ends_differ_by_reason_or_by_what_was_reached_and_count_as_the_last_step():
    one = episodes([1, 1, 1], [[True], [True], [True]], [5, 6, 7])
    other = episodes([1, 2, 1], [[True], [True], [False]], [9, 9, 9])
    assert [outcome_difference(one, other, i) for i in range(3)] == [None, 6, 7]


@pytest.mark.parametrize(
    ("flags", "place"), [([False, True, False], 1), ([True, True], None), ([False], None)]
)
def test_the_place_of_the_only_true_flag(flags, place):
    assert only_index(torch.tensor(flags)) == place


@pytest.mark.parametrize(
    ("is_compiled", "implementation"), [(True, "fused kernel"), (False, "PyTorch")]
)
def test_episodes_of_the_same_streams_are_those_of_an_evaluation(is_compiled, implementation):
    """Of 4 environments, 6 episodes: two batches, of four and of two."""
    policy, log = drone_rl.load_policy("good"), StepLog()
    with policy.flying(4, seed=3) as (env, actor):
        before = base_env(env).state_dict()
        flown = run_episodes(env, actor, 6)
        base_env(env).load_state_dict(before)
        batches = episode_batches(env, actor, 6, is_compiled=is_compiled, log=log)
        found = [final_episodes(env, batch) for batch in batches]
    assert log.implementation == implementation
    assert [len(one) for one in found] == [4, 2]
    assert torch.cat([one.length for one in found]).equal(flown.length)
    assert torch.cat([one.end_reason for one in found]).equal(flown.end_reason)
    assert torch.cat([one.goals.reached for one in found]).equal(flown.goals.reached)
    assert [len(actions) for actions in log.actions] == flown.length.tolist()
