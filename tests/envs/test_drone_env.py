"""The batched TorchRL environment, and direct rendering with the same observations."""

import copy
import functools
import pickle
from pathlib import Path

import pytest
import torch
from tensordict import TensorDict
from torchrl.envs import Compose, RewardSum, TransformedEnv
from torchrl.envs.utils import check_env_specs

from drone_rl.config import AppearanceSettings, TaskSettings
from drone_rl.envs import (
    DroneEnv,
    GrayPixels,
    StandardizePixels,
)
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.utils.errors import InputError
from tests.forked import run_forked

SHORT = TaskSettings(num_cubes=1, first_distance=3.0, step_limit=5, front_margin=3.0)


def actions(env, value):
    return torch.full(env.batch_size, value, dtype=torch.int64)


@pytest.mark.parametrize("pixels", [True, False])
@pytest.mark.parametrize("num_envs", [1, 3])
def test_specs(num_envs, pixels):
    env = DroneEnv(num_envs, SHORT, pixels=pixels)
    check_env_specs(env, break_when_any_done="both")
    env.close()


def make_transformed_env(**settings):
    """Return an environment with pixel transforms and reward sums, as TorchRL's collectors need."""
    env = DroneEnv(2, SHORT, **settings)
    return TransformedEnv(env, Compose(GrayPixels(), StandardizePixels(), RewardSum()))


def compare_with_one_batch(kind, **how):
    """Compare two workers with two environments each with one batch of four."""
    make = [functools.partial(make_transformed_env, seed=4, first_world=first) for first in (0, 2)]
    env = kind(2, pickle.loads(pickle.dumps(make)), **how)
    try:
        env.set_seed(4, static_seed=True)
        cubes = env.reset()["info", "cube_positions"].flatten(0, 1)
        assert torch.equal(cubes, DroneEnv(4, SHORT, seed=4).reset()["info", "cube_positions"])
        states = env.rollout(12, lambda td: td.set("action", torch.zeros(2, 2).long()))
        assert states["next", "done"][:, :, -1].any()
    finally:
        env.close()


def test_parallel_environments_equal_one_batch():
    """The workers are forks, which need not import the package; their factories are pickled."""
    code = (
        "from torchrl.envs import ParallelEnv\n"
        "from tests.envs.test_drone_env import compare_with_one_batch\n"
        "compare_with_one_batch(ParallelEnv, mp_start_method='fork')"
    )
    done = run_forked(code, cwd=Path(__file__).parents[2])
    assert done.returncode == 0, done.stderr


def test_environments_reset_independently():
    """Ten steps; one environment flies ahead and one moves left and right until its limit."""
    env = make_transformed_env(pixels=True)
    moves = torch.tensor([[0], [1]])
    policy = iter([moves, moves * 2] * 5)  # always forward; alternating left and right
    rollout = env.rollout(
        10, lambda td: td.set("action", next(policy)[:, 0]), break_when_any_done=False
    )
    done, drone = rollout["next", "done"][..., 0], rollout["info", "drone"]
    after = rollout["next", "info", "drone"]
    start = torch.tensor([0.0, 0.0, SHORT.altitude])
    assert done[1].nonzero()[:, 0].tolist() == [4, 9]  # the limit is 5 steps
    assert done[0].any() and not torch.equal(*done)
    for world in range(2):
        for t in range(9):
            wanted = start if done[world, t] else after[world, t]
            assert torch.equal(drone[world, t + 1], wanted)
    sums = rollout["next", "episode_reward"][0, :, 0]
    assert sums[done[0]].max() <= 1.0  # at most the reward of its only cube
    env.close()


def test_seed_determines_episodes():
    def first(seed):
        return DroneEnv(2, pixels=False, seed=seed).reset()["info", "cube_positions"]

    assert torch.equal(first(1), first(1))
    assert not torch.equal(first(1), first(2))
    env = DroneEnv(2, pixels=False)
    env.set_seed(1)
    assert torch.equal(env.reset()["info", "cube_positions"], first(1))


def test_batch_equals_single_environments():
    together = DroneEnv(3, seed=4)
    alone = [DroneEnv(1, seed=4, first_world=i) for i in range(3)]
    states = [env.reset() for env in (together, *alone)]
    for action in (0, 1, 2, 0, 0):
        for i, state in enumerate(states[1:]):
            assert torch.equal(states[0][i]["pixels"], state[0]["pixels"])
            assert torch.equal(states[0][i]["info", "drone"], state[0]["info", "drone"])
        envs = (together, *alone)
        states = [
            env.step(state.set("action", actions(env, action)))["next"].exclude("reward")
            for env, state in zip(envs, states, strict=True)
        ]


def test_partial_reset_resets_and_renders_only_masked_environments():
    env = DroneEnv(3, seed=0)
    state = env.reset()
    after = env.step(state.set("action", actions(env, 0)))["next"]
    drawn = []
    render = env.worlds.render
    env.worlds.render = lambda state, *view: drawn.append(len(state.drone)) or render(state, *view)
    mask = torch.tensor([[False], [True], [False]])
    reset = env.reset(after.clone().exclude("reward").set("_reset", mask))
    assert drawn == [1]
    assert reset["info", "drone"][:, 0].tolist() == [1.0, 0.0, 1.0]
    assert torch.equal(reset["pixels"][[0, 2]], after["pixels"][[0, 2]])
    assert torch.equal(reset["info", "cube_positions"][0], after["info", "cube_positions"][0])
    assert not torch.equal(reset["info", "cube_positions"][1], after["info", "cube_positions"][1])


def test_partial_step_skips_the_other_environments():
    env = DroneEnv(2, seed=0)
    state = env.reset().set("action", actions(env, 0))
    state["_step"] = torch.tensor([True, False])
    after = env.step(state)["next"]
    assert after["info", "drone"][:, 0].tolist() == [1.0, 0.0]
    assert torch.equal(after["pixels"][1], state["pixels"][1])


def test_truncation_is_exact_and_distinct_from_termination():
    env = DroneEnv(1, SHORT, pixels=False)
    state = env.reset()
    for step in range(1, 6):
        state = env.step(state.set("action", actions(env, 1 + step % 2)))["next"]
        assert state["truncated"].item() == (step == 5)
    assert state["done"].item()
    assert not state["terminated"].item()
    assert state["info", "end_reason"].item() == CubesEnd.STEP_LIMIT


def test_running_state_resumes_within_episodes():
    env = DroneEnv(2, SHORT, seed=0)
    state = env.reset()
    state["action"] = torch.tensor([1, 2])
    env.step(state)
    saved = copy.deepcopy(env.running_state())
    other = DroneEnv(2, SHORT, seed=99)
    other.reset()
    other.load_running_state(saved)
    assert torch.equal(other.last_pixels, env.last_pixels)
    for action in ([0, 0], [1, 0]):
        command = TensorDict({"action": torch.tensor(action)}, [2])
        one, two = (e.step(command.clone())["next"] for e in (env, other))
        assert all(torch.equal(one[k], two[k]) for k in ("pixels", "reward", "done"))
    assert torch.equal(*(e.reset()["info", "cube_positions"] for e in (env, other)))
    with pytest.raises(InputError, match="num_envs=2"):
        DroneEnv(3, SHORT, pixels=False).load_running_state(saved)


FOGGY = AppearanceSettings(fog_visibility=(5.0, 50.0), ground_texture="checker", ground_tile=1.0)


def test_each_episode_has_its_own_appearance_and_the_same_scene():
    plain, foggy = DroneEnv(3, SHORT), DroneEnv(3, SHORT, appearance=FOGGY)
    alone = DroneEnv(1, SHORT, appearance=FOGGY)
    for episode in range(2):
        seen, now, single = (env.reset() for env in (plain, foggy, alone))
        assert torch.equal(seen["info", "drone"], now["info", "drone"])
        assert torch.equal(plain.worlds.state.places, foggy.worlds.state.places)
        assert (now["pixels"] != seen["pixels"]).double().mean() > 0.2
        assert torch.equal(now["pixels"][0], single["pixels"][0])
        assert len(foggy.appearances.values[:, 14].unique()) == 3
        if episode == 0:
            before = foggy.appearances.values
    assert not (foggy.appearances.values[:, 14] == before[:, 14]).any()
    for env in (plain, foggy, alone):
        env.close()


def test_appearance_lasts_for_an_episode_and_is_restored():
    env, other = (DroneEnv(2, SHORT, appearance=FOGGY, seed=i) for i in range(2))
    started = env.reset()
    env.step(started.set("action", actions(env, 0)))
    other.reset()
    other.load_running_state(env.running_state())
    assert torch.equal(other.last_pixels, env.last_pixels)
    looks = env.appearances.values
    env.reset(TensorDict({"_reset": torch.tensor([[True], [False]])}, [2]))
    assert torch.equal(env.appearances.values[1], looks[1])
    assert not torch.equal(env.appearances.values[0], looks[0])
    env.close()
    other.close()


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (torch.tensor([7, 0]), "actions from 0 to 7 are not all in"),
        (torch.zeros(2), "actions are numbers with a point; give indices of env.action_spec"),
        (torch.zeros(2, 3, dtype=torch.int64), r"shape \(2, 3\); give torch.Size\(\[2\]\)"),
    ],
)
def test_invalid_actions_are_named(action, message):
    env = DroneEnv(2, SHORT)
    with pytest.raises(InputError, match=message):
        env.step(env.reset().set("action", action))


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_specs_on_gpu():
    check_env_specs(DroneEnv(3, SHORT, device="cuda"))
