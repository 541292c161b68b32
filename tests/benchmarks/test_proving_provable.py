"""Figures of trainings that stop when the policy is proved."""

import json

from benchmarks import commands as running
from benchmarks.proving import bench_provable


def test_results_of_all_runs_are_collected(monkeypatch, tmp_path):
    commands = []

    def call(*command):
        commands.append(command)
        run = tmp_path / next(c for c in command if "run.dir" in c).split("=")[1]
        run.mkdir(parents=True)
        reason = "proved" if len(commands) == 1 else "frames"
        rounds = [{"frames": 10}] * (1 + len(commands))
        (run / "result.json").write_text(json.dumps({"reason": reason, "rounds": rounds}))

    monkeypatch.setattr(running, "call", call)
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
