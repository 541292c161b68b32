"""Evaluations as a user runs them, of good files and of bad ones."""

import json
from pathlib import Path

import torch

from tests.cli.running import error_line


def test_evaluate_writes_table_json_and_videos(run, in_process):
    args = ["evaluate", f"checkpoint={run}", "episodes=5", "videos=1", "hydra.run.dir=evaluation"]
    done = in_process(*args, cwd=run)
    assert done.returncode == 0, done.stderr
    assert "all cubes" in done.stdout
    assert "oracle" in done.stdout
    report = json.loads((run / "evaluation" / "evaluation.json").read_text())
    assert report["oracle"]["mean_goals"] == 1.0
    assert report["greedy"]["episodes"] == report["sampled"]["episodes"] == 5
    assert {p.suffix for p in (run / "evaluation" / "videos").iterdir()} == {".mp4", ".gif"}


def test_checkpoint_of_another_architecture_truncated_or_with_code(run, in_process, tmp_path):
    state = torch.load(run / "checkpoints" / "last.pt", weights_only=True)
    state["description"]["network"]["hidden"] = [7]
    torch.save(state, tmp_path / "other.pt")
    line = error_line(in_process("evaluate", "checkpoint=other.pt", cwd=tmp_path))
    assert "fc1" in line
    data = (run / "checkpoints" / "last.pt").read_bytes()
    (tmp_path / "short.pt").write_bytes(data[: len(data) // 2])
    line = error_line(in_process("evaluate", "checkpoint=short.pt", cwd=tmp_path))
    assert "damaged" in line
    torch.save({"format": "drone_rl checkpoint", "x": Path("/")}, tmp_path / "code.pt")
    line = error_line(in_process("evaluate", "checkpoint=code.pt", cwd=tmp_path))
    assert "could run code" in line


def test_unknown_setting_of_the_evaluated_task(run, in_process):
    line = error_line(in_process("evaluate", f"checkpoint={run}", "task.num_cubs=5", cwd=run))
    assert "num_cubs" in line
    line = error_line(in_process("evaluate", f"checkpoint={run}", "task.num_cubes=0", cwd=run))
    assert "num_cubes=0" in line
