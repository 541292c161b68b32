"""Programs of users with Gymnasium and TorchRL, also with what they inherit from elsewhere."""

import copy
import os
import pickle
import subprocess
import sys

import pytest
import torch
from torchrl.collectors import Collector
from torchrl.envs import GymEnv, GymWrapper, check_env_specs

import drone_rl
from drone_rl.envs import DroneEnv
from drone_rl.sim.composer_task import make_environment
from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", minversion="1.1", reason="Gymnasium is not installed")
from gymnasium import wrappers  # noqa: E402
from gymnasium.wrappers import vector  # noqa: E402

CUBES = "drone_rl/CollectCubes-v0"
IDS = [CUBES, "drone_rl/Pillars-v0"]


@pytest.mark.parametrize("name", IDS)
def test_torchrl(name):
    for env in (GymEnv(name, frame_skip=2), GymWrapper(gymnasium.make(name))):
        check_env_specs(env)
        assert env.rollout(3).shape == (3,)


@pytest.mark.parametrize("mode", ["SameStep", "Disabled"])
def test_torchrl_with_a_vector_environment(mode):
    env = GymWrapper(gymnasium.make_vec(CUBES, num_envs=2, autoreset_mode=mode))
    check_env_specs(env)
    assert env.rollout(3, break_when_any_done=False).shape == (2, 3)


def test_collector_of_torchrl():
    env = GymEnv(CUBES, observations="state")
    collector = Collector(env, frames_per_batch=60, total_frames=120)
    assert [len(batch) for batch in collector] == [60, 60]
    collector.shutdown()


def act(env):
    observation, _ = env.reset(seed=0)
    for _ in range(3):
        observation = env.step(env.action_space.sample())[0]
    assert observation in env.observation_space
    env.close()


@pytest.mark.parametrize("mode", ["sync", "async", "vector_entry_point"])
def test_vectorization_of_gymnasium(mode):
    act(gymnasium.make_vec(CUBES, num_envs=1, vectorization_mode=mode))


@pytest.mark.parametrize("name", IDS)
def test_wrappers_of_gymnasium(name):
    env = vector.RecordEpisodeStatistics(gymnasium.make_vec(name, num_envs=2))
    act(vector.NormalizeReward(vector.NormalizeObservation(env)))
    env = wrappers.RecordEpisodeStatistics(gymnasium.make(name))
    act(wrappers.FrameStackObservation(wrappers.GrayscaleObservation(env), 4))


def test_inherited_environment_without_a_home(tmp_path):
    code = """
import os
home = os.environ["HOME"]
import drone_rl, warp
from drone_rl.trust.plots.saving import new_chart
from drone_rl.sim.rendering.devices import start_warp
start_warp("cpu")
assert os.access(warp.config.kernel_cache_dir, os.W_OK)
assert os.environ["HOME"] == home
"""
    caches = ("WARP_CACHE_PATH", "XDG_CACHE_HOME")
    environment = {k: v for k, v in os.environ.items() if k not in caches}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**environment, "HOME": "/dev/null/home"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "WARP_CACHE_PATH" in done.stderr


def copies(env):
    return copy.deepcopy(env), pickle.loads(pickle.dumps(env))


def test_copies_continue_like_the_original():
    env = DroneEnv(2)
    env.rollout(2)
    action = env.rand_action(env.reset())
    for other in copies(env):
        assert torch.equal(env.last_pixels, other.last_pixels)
    first = [one.step(action.clone())["next", "pixels"] for one in (*copies(env), env)]
    assert torch.equal(first[0], first[2]) and torch.equal(first[1], first[2])
    for env in (gymnasium.make(CUBES), gymnasium.make_vec(CUBES, num_envs=2)):
        env.reset(seed=0)
        action = env.action_space.sample()
        first = [one.step(action)[0] for one in (*copies(env), env)]
        assert (first[0] == first[2]).all() and (first[1] == first[2]).all()


def test_a_closed_environment_and_other_modes_of_torch():
    env = DroneEnv(2)
    env.close()
    assert env.rollout(2).shape == (2, 2)
    with torch.inference_mode():
        env = DroneEnv(2)
        env.rollout(2)
    with torch.autocast("cpu", torch.bfloat16):
        assert env.rollout(2)["next", "reward"].dtype == torch.float32


@pytest.mark.parametrize("copied", [copy.deepcopy, pickle.dumps])
def test_environments_of_dm_control_are_not_copied(copied):
    with pytest.raises(InputError, match="call make_environment again"):
        copied(make_environment(pixels=False))


def test_other_default_types_and_devices_of_torch_are_refused():
    torch.set_default_dtype(torch.float64)
    try:
        with pytest.raises(InputError, match=r"set_default_dtype\(torch.float32"):
            DroneEnv(1)
        with pytest.raises(InputError, match="float64"):
            drone_rl.load_policy("good")
    finally:
        torch.set_default_dtype(torch.float32)
    with torch.device("meta"), pytest.raises(InputError, match=r"set_default_device\('cpu'"):
        DroneEnv(1)
