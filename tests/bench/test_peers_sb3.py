"""The program, in short form."""

import json
import subprocess
import sys
import time

import pytest

from drone_rl.bench.peers_sb3 import measure
from drone_rl.utils.errors import InputError


def test_a_line_of_what_was_measured():
    reason = "Stable-Baselines3 is not installed"
    pytest.importorskip("stable_baselines3", reason=reason)
    short = {"num_envs": 4, "n_steps": 8, "batch_size": 8, "n_epochs": 1}
    options = ["--seed", "1", "--max-frames", "32", "--episodes", "3"]
    command = [sys.executable, "-m", "drone_rl.bench.peers_sb3", "ppo", *options]
    began = time.time()
    command += ["--started", str(began), "--settings", json.dumps(short)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (line,) = done.stdout.splitlines()
    found = json.loads(line)
    assert 0 < found["seconds_without_imports"] < found["seconds"] < time.time() - began
    assert (found["frames"], found["is_solved"]) == (32, False)
    assert 0 <= found["success_lower95"] <= found["success"] <= 1


def test_without_it_one_line_tells_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(InputError, match=r"peers_sb3 needs .*pip install 'drone-rl\[sb3\]'$"):
        measure(["ppo"])
