"""Figures of imitation, from the files that the commands write."""

import json

from benchmarks import commands as running
from benchmarks import imitation, training
from benchmarks.imitation import bench_imitation


def test_each_seed_clones_and_continues(monkeypatch, tmp_path):
    commands, recorded = [], []

    def call(*command):
        commands.append(command)
        run = tmp_path / next(c for c in command if "run.dir" in c).split("=")[1]
        run.mkdir(parents=True, exist_ok=True)
        number = len(commands)
        cloning = {"held_out_accuracy": 0.9, "seconds": 2.0}
        result = {"frames": number, "reason": "solved", "cloning": cloning}
        (run / "result.json").write_text(json.dumps(result))
        success = {"greedy": {"success": {"share": number / 10, "lower95": 0.0}}}
        (run / "evaluation.json").write_text(json.dumps(success))

    for module in (training, running):
        monkeypatch.setattr(module, "call", call)

    def record(*args, **how):
        recorded.append((args, how))

    monkeypatch.setattr(imitation, "record_oracle", record)
    found = bench_imitation(tmp_path, [3, 4], 1000, "cpu", False)
    assert found == {
        "imitation_success": [0.2, 0.6],
        "imitation_reinforce_success": [0.4, 0.8],
        "imitation_accuracy": [0.9, 0.9],
        "imitation_s": [2.0, 2.0],
        "imitation_reinforce_frames": [3, 7],
        "imitation_solved": 2,
    }
    assert recorded == [
        ((tmp_path / f"demonstrations_{s}",), {"flights": 30, "seed": 2000 + s}) for s in (3, 4)
    ]
    assert [c[0] for c in commands] == ["train", "evaluate"] * 4
    assert all("experiment=imitation" in c for c in commands[::2])
    assert all("episodes=1000" in c for c in commands[1::2])
    only = ["trainer.total_frames=0" in c for c in commands[::2]]
    assert only == [True, False, True, False]
    assert f"demonstrations={tmp_path / 'demonstrations_4'}" in commands[-2]
    assert len(bench_imitation(tmp_path / "quick", [3, 4], 1000, "cpu", True)["imitation_s"]) == 1
