"""Rollouts of the fused kernel equal those of single steps, also across batches and resumed."""

import copy
from functools import partial

import pytest
import torch
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.acceleration import FusedRollouts
from drone_rl.collectors import RolloutCollector
from drone_rl.envs import CropRows, GrayPixels, Shift, StandardizePixels
from drone_rl.envs.rollout import Act, Recording
from drone_rl.training.restore import check_fits
from tests.acceleration.test_fused_episodes import (
    FLYING,
    RANDOM,
    SEVERAL,
    SHORT,
    STACK,
    VELOCITY,
    make,
)

PAYING = SHORT.replace(reward={"reached": 1.0, "progress": 0.5})


def make_rollouts(**how):
    collector = make(**how)
    return RolloutCollector(collector.env, collector.actor, 7, compiled=True)


class Again:
    """An agent that takes the actions of a batch, (N, T, *), again."""

    def take(self, actions):
        self._left = list(actions.unbind(1))

    def act(self, context):
        return Act(self._left.pop(0))


def assert_equal(one, other):
    for key in other.keys(True, True):
        assert one[key].dtype == other[key].dtype and torch.equal(one[key], other[key]), key


@pytest.mark.parametrize(
    "how",
    [
        {"task": PAYING, "transforms": (GrayPixels, STACK, StandardizePixels)},
        {"dynamics": FLYING, "actions": VELOCITY},
        {
            "appearance": RANDOM,
            "transforms": (GrayPixels, partial(Shift, 4, 6), STACK, partial(CropRows, 3, 23)),
        },
        *({"inputs": inputs, **how} for inputs, how in SEVERAL),
    ],
)
def test_rollouts_equal_single_steps(how):
    fused, again = make_rollouts(**how), Again()
    assert isinstance(fused.fused, FusedRollouts) and fused.name == "fused collector"
    stepping = RolloutCollector(make(**how).env, Recording(again), 7)
    for _ in range(6):
        batch = fused.collect()
        again.take(batch["action"])
        stepped = stepping.collect()
        assert {*batch.keys(True, True)} == {*stepped.keys(True, True), "logits"}
        assert_equal(batch, stepped)
    assert fused.episodes == stepping.episodes > 4
    network = fused.actor.network
    outputs = network(*(batch[name] for name in network.in_keys))
    torch.testing.assert_close(outputs, batch["logits"], atol=1e-4, rtol=1e-4)


def test_resumed_rollouts_are_the_same():
    how = {"transforms": (GrayPixels, partial(Shift, 4, 6), STACK), "appearance": RANDOM}
    first, second = make_rollouts(**how), make_rollouts(**how)
    first.collect()
    state, drawn = copy.deepcopy(first.state_dict()), first.actor.generator.get_state()
    assert state["step_count"].any()  # episodes are running
    wanted = [first.collect() for _ in range(4)]
    second.collect()
    check_fits(state, second.state_dict(), "collector")
    second.load_state_dict(state)
    second.actor.generator.set_state(drawn)
    for batch in wanted:
        assert_equal(second.collect(), batch)


def test_other_explorations_begin_new_episodes():
    collector = make_rollouts()
    collector.collect()
    with set_exploration_type(ExplorationType.MODE):
        assert collector.collect()["next", "step_count"][:, 0].tolist() == [[1]] * 5
    assert collector.collect()["next", "step_count"][:, 0].tolist() == [[1]] * 5
