"""Runs the example on exported policies."""

from pathlib import Path

import drone_rl
from drone_rl.trust import onnx_export as exporting

PATH = Path(__file__).parents[2] / "examples" / "run_onnx.py"


def test_rewards_equal_those_of_the_policy(example, tmp_path, monkeypatch):
    monkeypatch.setattr(exporting, "_STEPS", 5)  # a few images suffice here
    target = tmp_path / "good.onnx"
    drone_rl.export_onnx("good", target)
    assert example.fly(str(target), episodes=1) == [3.0]
