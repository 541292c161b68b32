"""Figures of whole trainings, from the files that the commands write."""

import json

from benchmarks import commands as running
from benchmarks import training
from benchmarks.training import bench_large, bench_pillars, bench_seeds, bench_solve


def record_calls(monkeypatch, folder):
    """Replace the commands by a stub that writes their files; return the list of calls."""
    commands = []

    def call(*command):
        commands.append(command)
        name = "result.json" if command[0] == "train" else "evaluation.json"
        run = folder / next(c for c in command if "run.dir" in c).split("=")[1]
        run.mkdir(parents=True, exist_ok=True)
        lower = {"greedy": {"success": {"lower95": 0.9}}}
        (run / name).write_text(
            json.dumps({"frames": 10 * len(commands), "reason": "solved", "seconds": 0.5, **lower})
        )

    for module in (training, running):
        monkeypatch.setattr(module, "call", call)
    return commands


def test_solve_collects_the_results_of_each_seed(monkeypatch, tmp_path):
    commands = record_calls(monkeypatch, tmp_path)
    result = bench_solve(tmp_path, [3, 4], 100, "cpu", False)
    assert [c[0] for c in commands] == ["train", "evaluate"] * 2
    assert "seed=3" in commands[0] and "seed=4" in commands[2]
    assert (result["seeds_solved"], result["seeds_tried"]) == (2, 2)
    assert result["frames_to_solve"] == [10, 30]
    assert result["success_lower95"] == [0.9, 0.9]
    assert result["learning_fps"] == 40.0  # of 20 and 60
    assert len(result["time_to_solve_s"]) == 2
    assert len(bench_solve(tmp_path, [3, 4], 100, "cpu", True)["frames_to_solve"]) == 1


def test_pillars_uses_its_experiment(monkeypatch, tmp_path):
    commands = record_calls(monkeypatch, tmp_path)
    result = bench_pillars(tmp_path, [3, 4], 100, "cpu", False)
    assert [c[0] for c in commands] == ["train", "evaluate"] * 2
    assert all("experiment=pillars" in c for c in commands[::2])
    assert result["pillars_lower95"] == [0.9, 0.9] and result["pillars_solved"] == 2
    assert result["pillars_frames"] == [10, 30] and len(result["pillars_train_s"]) == 2


def test_seeds_trains_twenty_other_seeds(monkeypatch, tmp_path):
    commands = record_calls(monkeypatch, tmp_path)
    result = bench_seeds(tmp_path, "cpu", False)
    trainings = commands[::2]
    assert len(trainings) == 20 and all(f"seed={200 + i}" in c for i, c in enumerate(trainings))
    assert all("episodes=1000" in c for c in commands[1::2])
    assert result["seeds_solved_of_20"] == 20 and result["seeds_lower95"] == [0.9] * 20
    assert result["seeds_frames"][:2] == [10, 30] and len(result["seeds_s"]) == 20
    assert len(bench_seeds(tmp_path, "cpu", True)["seeds_s"]) == 2


def test_large_is_measured_with_cached_kernels(monkeypatch, tmp_path):
    commands = record_calls(monkeypatch, tmp_path)
    assert bench_large(tmp_path, "cpu", False) == {"learning_fps_large": 40.0}  # 20 in 0.5 s
    assert len(commands) == 2 and all("experiment=large" in c for c in commands)
