"""The example flies what was exported, and is short."""

import importlib.util
from pathlib import Path

import pytest

import drone_rl

PATH = Path(__file__).parents[2] / "examples" / "run_onnx.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("run_onnx", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("name", "cubes"), [("good", 3.0), ("poor", 0.0)])
def test_it_flies_as_the_policy_does(example, name, cubes, tmp_path):
    target = tmp_path / f"{name}.onnx"
    drone_rl.export_onnx(name, target)
    assert example.fly(str(target), episodes=3) == [cubes] * 3


def test_it_is_short():
    assert len(PATH.read_text().splitlines()) <= 40
