"""The example runs as it stands, in short form, and is short itself."""

import importlib.util
import math
from pathlib import Path

import pytest

PATH = Path(__file__).parents[2] / "examples" / "train_with_torchrl.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("train_with_torchrl", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_two_updates(example):
    rewards = example.train(num_envs=4, steps=160, max_frames=1280)
    assert len(rewards) == 2
    assert all(math.isfinite(reward) and 0 <= reward <= 3 for reward in rewards)
    assert rewards == example.train(num_envs=4, steps=160, max_frames=1280)  # same seed
    assert rewards != example.train(num_envs=4, steps=160, max_frames=1280, seed=1)


def test_it_stops_at_the_target(example):
    assert len(example.train(num_envs=4, steps=160, max_frames=10_000, target=0.0)) == 1


def test_it_is_short():
    assert len(PATH.read_text().splitlines()) <= 80


@pytest.mark.slow
def test_it_reaches_the_target(example):
    assert example.train()[-1] >= 2.97
