"""Programs of users run from a folder of their own, also with what they inherit from elsewhere."""

import os
import subprocess
import sys

import pytest

from tests.forked import run_forked

pytest.importorskip("gymnasium", minversion="1.1", reason="Gymnasium is not installed")

IDS = ["drone_rl/CollectCubes-v0", "drone_rl/Pillars-v0"]
TORCHRL = {
    "GymEnv": """
env = GymEnv(NAME, frame_skip=2)
check_env_specs(env)
assert env.rollout(3).shape == (3,)
""",
    "GymWrapper": """
env = GymWrapper(gymnasium.make(NAME))
check_env_specs(env)
assert env.rollout(3).shape == (3,)
""",
    "GymWrapper of a vector environment": """
for mode in ("SameStep", "Disabled"):
    env = GymWrapper(gymnasium.make_vec(NAME, num_envs=2, autoreset_mode=mode))
    check_env_specs(env)
    assert env.rollout(3, break_when_any_done=False).shape == (2, 3)
""",
    "Collector": """
collector = Collector(GymEnv(NAME, observations="state"), frames_per_batch=60, total_frames=120)
assert [len(batch) for batch in collector] == [60, 60]
collector.shutdown()
""",
}
GYMNASIUM = {
    "vector wrappers": """
env = gymnasium.make_vec(NAME, num_envs=2)
env = vector.NormalizeReward(vector.NormalizeObservation(vector.RecordEpisodeStatistics(env)))
act(env)
""",
    "wrappers": """
env = wrappers.RecordEpisodeStatistics(gymnasium.make(NAME))
act(wrappers.FrameStackObservation(wrappers.GrayscaleObservation(env), 4))
""",
    "sync": "act(gymnasium.make_vec(NAME, num_envs=2, vectorization_mode='sync'))",
    "async": "act(gymnasium.make_vec(NAME, num_envs=2, vectorization_mode='async'))",
    "entry point": """
act(gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="vector_entry_point"))
""",
}
INHERITED = {
    "no home": (
        {"HOME": "/dev/null/home"},
        """
import warp
from drone_rl.trust.plots.saving import new_chart
from drone_rl.sim.rendering.devices import start_warp
start_warp("cpu")
assert os.access(warp.config.kernel_cache_dir, os.W_OK)
""",
    ),
}


def run(code, folder):
    done = run_forked(code, cwd=folder)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("program", TORCHRL)
def test_torchrl_programs(tmp_path, program, name):
    head = """
import gymnasium, drone_rl
from torchrl.collectors import Collector
from torchrl.envs import GymEnv, GymWrapper, check_env_specs
"""
    run(f"{head}NAME = {name!r}\n{TORCHRL[program]}", tmp_path)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("program", GYMNASIUM)
def test_gymnasium_programs(tmp_path, program, name):
    head = """
import gymnasium, drone_rl
from gymnasium import wrappers
from gymnasium.wrappers import vector

def act(env):
    env.reset(seed=0)
    for _ in range(3):
        observation = env.step(env.action_space.sample())[0]
    assert observation in env.observation_space
    env.close()

"""
    run(f"{head}NAME = {name!r}\n{GYMNASIUM[program]}", tmp_path)


@pytest.mark.parametrize("situation", INHERITED)
def test_inherited_environment(tmp_path, situation):
    variables, program = INHERITED[situation]
    code = f"import os\nbefore = dict(os.environ)\nimport drone_rl\n{program}\n"
    names = f"for name in {list(variables)}: assert os.environ[name] == before[name]\n"
    caches = ("WARP_CACHE_PATH", "XDG_CACHE_HOME")
    environment = {k: v for k, v in os.environ.items() if k not in caches}
    done = subprocess.run(
        [sys.executable, "-c", code + names],
        cwd=tmp_path,
        env={**environment, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    if "HOME" in variables:
        assert "WARP_CACHE_PATH" in done.stderr


COPIES = """
import copy, pickle, gymnasium, torch, drone_rl
from drone_rl.envs import DroneEnv

def copies(env):
    return copy.deepcopy(env), pickle.loads(pickle.dumps(env))

env = DroneEnv(2)
env.rollout(2)
action = env.rand_action(env.reset())
for other in copies(env):
    assert torch.equal(env.last_pixels, other.last_pixels)
first = [one.step(action.clone())["next", "pixels"] for one in (*copies(env), env)]
assert torch.equal(first[0], first[2]) and torch.equal(first[1], first[2])
for env in (gymnasium.make(NAME), gymnasium.make_vec(NAME, num_envs=2)):
    env.reset(seed=0)
    action = env.action_space.sample()
    first = [one.step(action)[0] for one in (*copies(env), env)]
    assert (first[0] == first[2]).all() and (first[1] == first[2]).all()
"""
CLOSED = """
from drone_rl.envs import DroneEnv
env = DroneEnv(2)
env.close()
assert env.rollout(2).shape == (2, 2)
"""
INFERENCE = """
import torch
from drone_rl.envs import DroneEnv
with torch.inference_mode():
    env = DroneEnv(2)
    env.rollout(2)
with torch.autocast("cpu", torch.bfloat16):
    assert env.rollout(2)["next", "reward"].dtype == torch.float32
"""


@pytest.mark.parametrize("program", [COPIES, CLOSED, INFERENCE])
def test_copied_closed_and_inferring_environments(tmp_path, program):
    run(f"NAME = {IDS[0]!r}\n{program}", tmp_path)


@pytest.mark.parametrize(
    ("program", "line"),
    [
        ("copy.deepcopy(make_environment(pixels=False))", "call make_environment again"),
        ("pickle.dumps(make_environment(pixels=False))", "call make_environment again"),
        ("torch.set_default_dtype(torch.float64); DroneEnv(1)", "set_default_dtype(torch.float32"),
        ("torch.set_default_dtype(torch.float64); drone_rl.load_policy('good')", "float64"),
        ("torch.set_default_device('meta'); DroneEnv(1)", "set_default_device('cpu')"),
    ],
)
def test_what_is_not_supported_is_one_line(tmp_path, program, line):
    head = """
import copy, pickle, torch, drone_rl
from drone_rl.envs import DroneEnv
from drone_rl.sim.composer_task import make_environment
"""
    done = run_forked(head + program, cwd=tmp_path)
    assert done.returncode and line in done.stderr.splitlines()[-1]
    assert "InputError" in done.stderr.splitlines()[-1]
