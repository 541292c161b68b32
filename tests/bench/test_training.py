"""Figures of whole trainings: what is read of them."""

import json

from drone_rl.bench import training
from drone_rl.bench.training import bench_solve


def test_solving_gathers_what_each_seed_left(monkeypatch, tmp_path):
    commands = []

    def call(*command):
        commands.append(command)
        name = "result.json" if command[0] == "train" else "evaluation.json"
        folder = tmp_path / next(c for c in command if "run.dir" in c).split("=")[1]
        folder.mkdir(parents=True, exist_ok=True)
        lower = {"greedy": {"success": {"lower95": 0.9}}}
        (folder / name).write_text(
            json.dumps({"frames": 10 * len(commands), "reason": "solved", **lower})
        )

    monkeypatch.setattr(training, "call", call)
    result = bench_solve(tmp_path, [3, 4], 100, "cpu", False)
    assert [c[0] for c in commands] == ["train", "evaluate"] * 2
    assert "seed=3" in commands[0] and "seed=4" in commands[2]
    assert (result["seeds_solved"], result["seeds_tried"]) == (2, 2)
    assert result["frames_to_solve"] == [10, 30]
    assert result["success_lower95"] == [0.9, 0.9]
    assert len(result["time_to_solve_s"]) == 2
    assert len(bench_solve(tmp_path, [3, 4], 100, "cpu", True)["frames_to_solve"]) == 1
