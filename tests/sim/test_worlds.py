"""A batch of environments equals single environments in dm_control."""

import re

import numpy as np
import pytest
import torch

from drone_rl.config import AppearanceSettings, TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state


def test_batch_equals_dm_control_for_the_same_seed():
    settings = TaskSettings(num_cubes=2, first_distance=5.0, spacing=4.0, step_limit=40)
    actions = np.random.RandomState(0)
    ends = set()
    for seed in range(6):
        env = make_environment(settings, pixels=False, random_state=world_random_state(seed, 0))
        random_state = world_random_state(seed, 0)
        worlds = Worlds(1, settings)
        for _ in range(3):  # successive episodes of one environment
            timestep = env.reset()
            worlds.reset(torch.arange(1), [random_state])
            while not timestep.last():
                action = actions.choice(3, p=(0.6, 0.2, 0.2))
                timestep = env.step(action)
                reward = worlds.step(torch.arange(1), torch.tensor([action]))
                assert timestep.reward == reward.item()
                one, many = vars(env.task.state).copy(), vars(worlds.state).copy()
                for state in (one, many):
                    state |= vars(state.pop("body"))
                for name, value in one.items():
                    same = {"rtol": 0, "atol": 0, "equal_nan": True, "msg": name}
                    torch.testing.assert_close(value, many[name], **same)
                position, _ = env.task.drone.get_pose(env.physics)
                np.testing.assert_array_equal(position, worlds.state.drone[0].numpy())
            ends.add(EndReason(worlds.state.end_reason.item()))
    assert len(ends) >= 2


def test_scene_is_the_dm_control_model_with_semantic_classes():
    env = make_environment(pixels=False, random_state=world_random_state(0, 0))
    env.reset()
    worlds = Worlds(1)
    model, physics = worlds.scene.model, env.physics.model
    names = [model.geom(i).name for i in range(model.ngeom)]
    assert names == [physics.geom(i).name for i in range(physics.ngeom)]
    found = dict(
        zip(names, zip(worlds.scene.semantic_classes, worlds.scene.props, strict=True), strict=True)
    )
    assert found.pop("floor") == (SemanticClass.GROUND, -1)
    for i in range(3):
        assert found.pop(f"cube_{i}/geom") == (SemanticClass.TARGET, i)
    assert found.pop("drone/hull") == (SemanticClass.DRONE, -1)
    assert set(found.values()) == {(SemanticClass.DRONE, -1)} and len(found) == 4  # the rotors


def test_indexed_and_whole_batches_step_alike():
    worlds, turned = Worlds(2), Worlds(2)
    for each in (worlds, turned):
        each.reset(torch.arange(2), [world_random_state(0, i) for i in range(2)])
    worlds.step(torch.arange(2), torch.tensor([Move.LEFT, Move.FORWARD]))
    turned.step(torch.tensor([1, 0]), torch.tensor([Move.FORWARD, Move.LEFT]))
    assert worlds.state.drone.tolist() == [[0.0, 1.0, 2.5], [1.0, 0.0, 2.5]]
    assert torch.equal(worlds.state.drone, turned.state.drone)
    assert torch.equal(worlds.state.cubes, turned.state.cubes)


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
            worlds.task, "step", lambda *given, of=spoiled: (step(*given)[0], of(step(*given)[1]))
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


def test_combined_appearance_is_cached():
    worlds = Worlds(1, TaskSettings(), appearance=Appearance(fog_visibility=50.0))
    dark = Appearance(exposure=0.5)
    look = worlds._combine(dark)
    assert look is not None and (look.fog_visibility, look.exposure) == (50.0, 0.5)
    assert worlds._combine(dark) is look
    assert worlds._combine(None) is worlds.appearance
    bright = worlds._combine(Appearance(exposure=2.0))
    assert bright is not None and (bright.fog_visibility, bright.exposure) == (50.0, 2.0)
    worlds.appearance = None
    changed = worlds._combine(dark)
    assert changed is not None and (changed.fog_visibility, changed.exposure) == (None, 0.5)


@pytest.mark.parametrize("size", [{"height": 0}, {"width": 0}])
def test_images_without_pixels_are_refused(size):
    with pytest.raises(InputError, match="give 1 to 4096 each way"):
        Worlds(1).view(**size)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"num_envs": 0}, "^num_envs=0 is out of range"),
        ({"num_envs": 2.5}, "^num_envs=2.5"),
        ({"device": "gpu"}, "^device=gpu is unknown"),
        ({"appearance": AppearanceSettings()}, "^appearance=.* is no Appearance; give "),
        ({"renderer": 42}, "^renderer=42 is no renderer; give one of: raytrace"),
    ],
)
def test_invalid_arguments_raise(given, message):
    with pytest.raises(InputError, match=message):
        Worlds(**{"num_envs": 1, **given})
