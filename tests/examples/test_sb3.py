"""Runs the example in a short version."""

from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
PATH = Path(__file__).parents[2] / "examples" / "sb3.py"


def test_train_and_success(example):
    model = example.train(512, num_envs=32, steps=16)
    assert (model.num_timesteps, model.n_envs) == (512, 32)
    assert model.observation_space.shape == (1, 25, 64)
    assert 0 <= example.success(model, episodes=4) <= 1
