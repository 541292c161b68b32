"""The example runs as it stands, in short form, and is short itself."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
PATH = Path(__file__).parents[2] / "examples" / "sb3.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("sb3_example", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_update_and_a_few_flights(example):
    model = example.train(128, num_envs=8, steps=16)
    assert (model.num_timesteps, model.n_envs) == (128, 8)
    assert model.observation_space.shape == (1, 25, 64)
    assert 0 <= example.success(model, episodes=4) <= 1


def test_it_is_short():
    assert len(PATH.read_text().splitlines()) <= 50
