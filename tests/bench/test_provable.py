"""Figures of trainings until proved, and of what usual ones leave behind: what is read of them."""

import json

import pytest

import drone_rl
from drone_rl.api.progress import silent
from drone_rl.bench import provable
from drone_rl.bench.provable import bench_losing, bench_provable


def test_proved_runs_are_gathered(monkeypatch, tmp_path):
    commands = []

    def call(*command):
        commands.append(command)
        run = tmp_path / next(c for c in command if "run.dir" in c).split("=")[1]
        run.mkdir(parents=True)
        reason = "proved" if len(commands) == 1 else "frames"
        rounds = [{"frames": 10}] * (1 + len(commands))
        (run / "result.json").write_text(json.dumps({"reason": reason, "rounds": rounds}))

    monkeypatch.setattr(provable, "call", call)
    result = bench_provable(tmp_path, [3, 4], False)
    assert [c[:3] for c in commands] == [
        ("train", "experiment=provable", "seed=3"),
        ("train", "experiment=provable", "seed=4"),
    ]
    assert result["provable_rounds"] == [2, 3]
    assert result["provable_proved"] == [True, False]
    assert len(result["provable_s"]) == 2
    assert len(bench_provable(tmp_path / "quick", [3, 4], True)["provable_s"]) == 1
    assert "task=collect_one" in commands[-1]


def test_what_a_usual_training_leaves_is_exact(monkeypatch, tmp_path):
    class Done:
        policy = drone_rl.load_policy("right_and_forward")

    def train(*, folder, seed, progress):
        folder.mkdir(parents=True)
        assert progress is silent and seed == 7
        return Done

    monkeypatch.setattr(provable, "train", train)
    result = bench_losing(tmp_path, [7, 8], True)
    assert result["losing_default"] == [pytest.approx(0.3625, abs=1e-6)]
    assert result["losing_default_undecided"][0] < 1e-6
