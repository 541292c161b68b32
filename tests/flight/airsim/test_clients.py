"""AirSim's own clients, unmodified, in environments of their own.

`python -m tools.airsim_clients` makes the environments; without them these tests are skipped.
"""

import base64
import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import torch

from benchmarks.airsim_scripts import CLIENT_OF, PAIRS, run_script
from drone_rl.config import CameraSettings
from drone_rl.policies.policy import load_policy
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.worlds import Worlds
from tools.airsim_clients import CLIENTS, python_of

SCRIPTS = Path(__file__).parent / "clients"
POLICY_CAMERA = """{"SettingsVersion": 1.2, "CameraDefaults": {"CaptureSettings": [
  {"ImageType": 0, "Width": 64, "Height": 25, "FOV_Degrees": 135}]}}"""
EPISODES, MOST_ACTIONS = 3, 70


@pytest.fixture(params=[name for name in CLIENTS if name > "airsim-1.3"])
def command(request, start):
    """Return a function: the command of a script with one of the clients, against a server."""
    name = request.param
    python = python_of(name)
    if not python.exists():
        pytest.skip(f"{name} is not installed; run python -m tools.airsim_clients")

    def make(script, text=None, *args, **settings):
        server, _client = start(text, **settings)
        known = (python, SCRIPTS / script, CLIENTS[name].module, server.address[1])
        return [*map(str, (*known, *args))]

    return make


@pytest.fixture
def run(command):
    """Return a function that runs a script with one of the clients against a server."""

    def call(*args, **settings):
        done = subprocess.run(
            command(*args, **settings), capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1]), done.stdout

    return call


@pytest.mark.parametrize(("name", "version"), PAIRS)
def test_program(name, version, tmp_path):
    if not python_of(CLIENT_OF[version]).exists():
        pytest.skip(f"{CLIENT_OF[version]} is not installed; run python -m tools.airsim_clients")
    assert run_script(name, version, tmp_path) == []


def test_commands_that_are_not_joined_are_sent(run, tmp_path, monkeypatch):
    """With rpc-msgpack by the module of the page."""
    page = (Path(__file__).parents[3] / "docs" / "airsim.md").read_text()
    (module,) = re.findall(r'title="airsim_fixes.py"\n(.*?)```', page, re.DOTALL)
    (tmp_path / "airsim_fixes.py").write_text(module)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found, _ = run("not_joined.py", clock="wall")
    assert found["moved"] > 0.2
    assert found["twice"] == [2.0, 4.0, 6.0]
    assert found["numbers"] == [1.0, 2.0, 3.0]
    assert found["bytes"] == 256 * 144 * 3


@pytest.mark.parametrize("name", ["good", "right_and_forward"])
def test_a_policy_collects_what_it_collects_here(command, name):
    policy = load_policy(name)
    script = command("policy.py", POLICY_CAMERA, EPISODES, MOST_ACTIONS, scene="cubes", seed=4)
    channels = slice(None, None, -1 if "airsim" in script else 1)  # blue first in airsim's images
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(script, **pipes) as process:
        for line in process.stdout:
            if line.startswith("["):
                break
            image = np.frombuffer(base64.b64decode(line), np.uint8).reshape(25, 64, 3)
            process.stdin.write(f"{policy.act(image[..., channels].copy())}\n")
            process.stdin.flush()
        process.stdin.close()
    assert json.loads(line) == collected(policy)


def collected(policy):
    """Return the cubes that a policy collects in the episodes of the server's seed."""
    worlds = Worlds(1, CollectCubes(), CameraSettings())
    random, one = np.random.RandomState(np.random.PCG64(4)), torch.arange(1)
    worlds.reset(one, [random])  # the server's first placement, before reset
    found = []
    for _ in range(EPISODES):
        worlds.reset(one, [random])
        for _ in range(MOST_ACTIONS):
            image = worlds.render(worlds.state)[0]
            worlds.step(one, torch.tensor([policy.act(image)]))
            if worlds.state.end_reason[0]:
                break
        found.append(worlds.state.reached[0].tolist())
    worlds.close()
    return found
