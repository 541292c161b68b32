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

from drone_rl.config import CameraSettings
from drone_rl.policies.policy import load_policy
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.worlds import Worlds
from tests.flight.airsim.conftest import CV
from tools.airsim_clients import CLIENTS, python_of

SCRIPTS = Path(__file__).parent / "clients"
POLICY_CAMERA = """{"SettingsVersion": 1.2, "CameraDefaults": {"CaptureSettings": [
  {"ImageType": 0, "Width": 64, "Height": 25, "FOV_Degrees": 135}]}}"""
EPISODES, MOST_ACTIONS = 3, 70


@pytest.fixture(params=[*CLIENTS])
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


def test_flight(run):
    found, printed = run("fly.py")
    assert "Please upgrade" not in printed
    assert found["armed"] is True
    assert found["landed"] == 1 and found["height"] == pytest.approx(-2.0, abs=0.15)
    assert max(found["corners"]) < 0.8
    assert found["path"] == pytest.approx(12.0, abs=0.8)
    assert found["orbit"] == pytest.approx(6.0, abs=1.5)
    assert found["imu"] == pytest.approx(-9.8, abs=1.0)
    assert found["gps"] == pytest.approx(47.6415, abs=1e-3)
    assert (found["raw"], found["png"], found["floats"]) == (256 * 144 * 3, "89504e47", 256 * 144)
    assert found["below"] == pytest.approx(3.0, abs=0.5)
    assert found["landed_again"] == 0
    assert found["after_reset"] == [0.0, 0.0, 0.0]
    assert "getLidarData is not supported" in found["refused"]


def test_commands_that_are_not_joined_are_sent(run, tmp_path, monkeypatch):
    """With rpc-msgpack by the module of the page."""
    page = (Path(__file__).parents[3] / "docs" / "airsim.md").read_text()
    (module,) = re.findall(r'title="airsim_fixes.py"\n(.*?)```', page, re.DOTALL)
    (tmp_path / "airsim_fixes.py").write_text(module)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found, _ = run("not_joined.py", clock="wall")
    assert found["moved"] > 0.2
    assert found["twice"] == [2.0, 4.0, 6.0]
    assert found["bytes"] == 256 * 144 * 3


def test_computer_vision(run):
    found, _ = run("look.py", CV, scene="cubes")
    for step, (x, y, z) in enumerate(found["poses"]):
        assert (x, y) == pytest.approx((step, -step))
        assert z == pytest.approx([0.0, 0.2588, 0.5, 0.7071, 0.8660][step], abs=1e-4)
    assert len(found["sizes"]) == 35
    assert all(size > 0 for size in found["sizes"].values())
    assert found["objects"] == ["cube_0", "cube_1", "cube_2"]
    assert found["moved"] is True and found["there"] == 9.0
    assert found["id"] == 20
    assert found["fov"] == 90.0
    assert found["paused"] is True


def test_environment_for_reinforcement_learning(run):
    found, _ = run("gym_env.py", None, 200, scene="cubes")
    assert found["steps"] == 200
    assert found["shapes"] == [[144, 256, 3]]
    assert found["x"] > 5.0


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
        found.append(worlds.state.collected[0].tolist())
    worlds.close()
    return found
