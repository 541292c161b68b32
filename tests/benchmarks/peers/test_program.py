"""The program of third-party trainings, with short trainings."""

import json
import runpy
import sys
import time

import pytest

import drone_rl
from benchmarks.peers.program import measure, success_lower95
from drone_rl.utils.errors import InputError


def test_the_program_prints_one_line_of_json(monkeypatch, capsys):
    reason = "Stable-Baselines3 is not installed"
    pytest.importorskip("stable_baselines3", reason=reason)
    short = {"num_envs": 4, "n_steps": 8, "batch_size": 8, "n_epochs": 1}
    options = ["--seed", "1", "--max-frames", "32", "--episodes", "3"]
    began = time.time()
    options += ["--started", str(began), "--settings", json.dumps(short)]
    monkeypatch.setattr(sys, "argv", ["program", "sb3_ppo", *options])
    monkeypatch.delitem(sys.modules, "benchmarks.peers.program")
    runpy.run_module("benchmarks.peers.program", run_name="__main__")
    (line,) = capsys.readouterr().out.splitlines()
    found = json.loads(line)
    assert 0 < found["seconds_without_imports"] < found["seconds"] < time.time() - began
    assert (found["frames"], found["is_solved"]) == (32, False)
    assert 0 <= found["success_lower95"] <= 1


def test_a_training_with_torchrls_collector():
    settings = json.dumps({"num_envs": 4, "steps": 160})
    found = measure(["torchrl", "--max-frames", "640", "--settings", settings])
    assert found["frames"] == 640 and not found["is_solved"]
    assert "success_lower95" not in found
    assert 0 < found["seconds_without_imports"] < found["seconds"]


def test_the_lower_bound_of_ten_successes():
    good = drone_rl.load_policy("good")
    assert success_lower95(good, 10) == pytest.approx(0.025 ** (1 / 10))  # 10 of 10


def test_without_the_library_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(InputError, match=r"bench peers needs .*pip install -e '.\[sb3\]' in the"):
        measure(["sb3_ppo"])
