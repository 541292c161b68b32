"""The example flies what was exported, and is short."""

from pathlib import Path

import pytest

import drone_rl
from drone_rl.verdicts import onnx_export as exporting

PATH = Path(__file__).parents[2] / "examples" / "run_onnx.py"


@pytest.mark.parametrize(("name", "cubes"), [("good", 3.0), ("poor", 0.0)])
def test_it_flies_as_the_policy_does(example, name, cubes, tmp_path, monkeypatch):
    monkeypatch.setattr(exporting, "_STEPS", 5)  # to agree on a few pictures will do here
    target = tmp_path / f"{name}.onnx"
    drone_rl.export_onnx(name, target)
    assert example.fly(str(target), episodes=3) == [cubes] * 3


def test_it_is_short():
    assert len(PATH.read_text().splitlines()) <= 40
