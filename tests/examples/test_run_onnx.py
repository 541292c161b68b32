"""Runs the example on exported policies."""

from pathlib import Path

import pytest

import drone_rl
from drone_rl.trust import onnx_export as exporting

PATH = Path(__file__).parents[2] / "examples" / "run_onnx.py"


@pytest.mark.parametrize(("name", "cubes"), [("good", 3.0), ("poor", 0.0)])
def test_rewards_equal_those_of_the_policy(example, name, cubes, tmp_path, monkeypatch):
    monkeypatch.setattr(exporting, "_STEPS", 5)  # a few images suffice here
    target = tmp_path / f"{name}.onnx"
    drone_rl.export_onnx(name, target)
    assert example.fly(str(target), episodes=3) == [cubes] * 3
