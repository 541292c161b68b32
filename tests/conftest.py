"""Shared fixtures."""

import os
import subprocess
import sys

# Tests run in parallel, one per core, so more threads would only compete.
os.environ.update(OMP_NUM_THREADS="1", OMP_WAIT_POLICY="PASSIVE")

import pytest

from tests.forked import stop_servers

# Fixtures import torch and the package, because the process that starts the workers needs neither.

# Else every worker, and every program that a test starts, compiles tests and package again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.fixture(autouse=True)
def one_thread():
    """Limit torch to one thread, whatever the previous test has set."""
    import torch

    torch.set_num_threads(1)


@pytest.fixture(autouse=True)
def exploration_stays():
    """Fail a test that leaves another exploration type, which is global, to the next ones."""
    from torchrl.envs.utils import exploration_type

    yield
    assert exploration_type() is None


@pytest.fixture(autouse=True)
def tasks_stay():
    """Remove tasks that the test registered, whose names later tests must not find."""
    from drone_rl.config.task import TASKS
    from drone_rl.sim.tasks.task import MAKERS

    before = dict(TASKS), dict(MAKERS)
    yield
    for registry, entries in zip((TASKS, MAKERS), before, strict=True):
        registry.clear()
        registry.update(entries)


@pytest.fixture(scope="session", autouse=True)
def _no_fork_server_is_left():
    yield
    stop_servers()


@pytest.fixture(scope="session")
def egl():
    """Skip the test if OpenGL cannot render without a display."""
    code = "from dm_control import _render; _render.Renderer(8, 8).make_current()"
    environment = {**os.environ, "MUJOCO_GL": "egl"}
    command = [sys.executable, "-c", code]
    if subprocess.run(command, env=environment, capture_output=True, check=False).returncode:
        pytest.skip("no OpenGL renderer (EGL) on this machine")
    if os.environ.get("MUJOCO_GL") != "egl":
        pytest.skip("EGL is available but not selected; set MUJOCO_GL=egl")


@pytest.fixture
def make_pipeline():
    """Return a factory of environments with default transforms and actors with a small network."""
    import torch

    from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
    from drone_rl.policies import SmallCNN, make_actor

    envs = []

    def build(num_envs=4, seed=0, **kwargs):
        env = DroneEnv(
            num_envs, seed=seed, **kwargs, transforms=[GrayPixels(), StandardizePixels()]
        )
        envs.append(env)
        generator = torch.Generator().manual_seed(seed)
        shape = tuple(env.observation_spec["pixels"].shape[1:])
        count = env.base_env.worlds.dynamics.actions.num_outputs
        network = SmallCNN(shape, count, channels=(4,), hidden=(8,), generator=generator)
        return env, make_actor(network, env.action_spec, generator)

    yield build
    for env in envs:
        env.close(raise_if_closed=False)


@pytest.fixture
def registered():
    """Return a decorator that registers variants for the duration of the test."""
    parts = []
    yield lambda part: parts.append(part) or part
    for part in parts:
        part.Settings.registry.pop(part.Settings.name, None)
