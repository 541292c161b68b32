"""A batch of environments: steps, appearances, and what it refuses."""

import re

import pytest
import torch

from drone_rl.config import ActionSettings, AppearanceSettings, TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state


def test_indexed_and_whole_batches_step_alike():
    worlds, turned = Worlds(2), Worlds(2)
    for each in (worlds, turned):
        each.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
    worlds.step(torch.arange(2), torch.tensor([Move.LEFT, Move.FORWARD]))
    turned.step(torch.tensor([1, 0]), torch.tensor([Move.FORWARD, Move.LEFT]))
    assert worlds.state.drone.tolist() == [[0.0, 1.0, 2.5], [1.0, 0.0, 2.5]]
    assert torch.equal(worlds.state.drone, turned.state.drone)
    assert torch.equal(worlds.state.places, turned.state.places)


@pytest.mark.parametrize("task", ["collect_cubes", "reach"])
def test_each_environment_needs_an_action(task):
    worlds = Worlds(3, task)
    with pytest.raises(InputError, match=r"actions of shape \(2,\) for 3 environments"):
        worlds.step(torch.arange(3), torch.zeros(2, dtype=torch.int64))


def test_a_task_whose_step_returns_no_pair_is_named(monkeypatch):
    worlds = Worlds(2, TaskSettings(num_cubes=1))
    worlds.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
    step = worlds.task.step
    monkeypatch.setattr(worlds.task, "step", lambda *given: step(*given)[1])
    ahead = (torch.arange(2), torch.zeros(2, dtype=torch.int64))
    with pytest.raises(InputError, match=r"CollectCubes\.step must return two things: the states"):
        worlds.step(*ahead)
    for spoiled in (lambda r: r[:, None], lambda r: r.mean(), lambda r: 0.5):
        monkeypatch.setattr(
            worlds.task,
            "step",
            lambda *given, of=spoiled: (step(*given)[0], of(step(*given)[1])),
        )
        with pytest.raises(InputError, match="a tensor with one number for each environment"):
            worlds.step(*ahead)


@pytest.mark.parametrize("reward", [torch.nan, -torch.inf, 2e10])
def test_a_reward_whose_sums_may_overflow_is_named(monkeypatch, reward):
    worlds = Worlds(2, TaskSettings(num_cubes=1))
    worlds.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
    step, rewards = worlds.task.step, torch.tensor([0.0, reward])
    monkeypatch.setattr(worlds.task, "step", lambda *given: (step(*given)[0], rewards))
    with pytest.raises(InputError, match=re.escape(f"returns a reward of {reward:g}; ")):
        worlds.step(torch.arange(2), torch.zeros(2, dtype=torch.int64))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"device": "gpu"}, "^device=gpu is unknown"),
        ({"appearance": AppearanceSettings()}, "^appearance=.*: it must be .* Appearance"),
        ({"renderer": 42}, "^renderer=42 is no renderer; give one of: raytrace"),
    ],
)
def test_invalid_arguments_raise(given, message):
    with pytest.raises(InputError, match=message):
        Worlds(**{"num_envs": 1, **given})


def test_images_of_a_mirrored_episode_are_mirrored():
    """Cubes on the other side, and the mirrored moves and turns."""
    worlds = Worlds(2, actions=ActionSettings(kind="moves_full", turn_step=20.0))
    cubes = torch.tensor([[[8.0, 3.0, 2.5], [12.0, -2.0, 2.5], [20.0, 1.0, 2.5]]]).double()
    worlds.state = worlds.start(torch.cat([cubes, cubes * torch.tensor([1.0, -1.0, 1.0])]))
    actions, view = worlds.dynamics.actions, worlds.view(modality="segmentation")
    seen = []
    for name in ("turn left", "left", "forward", "turn left", "back", "turn right"):
        action = actions.names.index(name)
        worlds.step(torch.arange(2), torch.tensor([action, actions.mirrored[action]]))
        one, other = worlds.render(worlds.state, view)
        assert torch.equal(one, other.flip(1))
        seen.append(one)
    assert not torch.equal(seen[0], seen[1]) and not torch.equal(seen[0], seen[3])
    worlds.close()
