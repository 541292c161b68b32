"""Runs the example in a short version."""

from pathlib import Path

import pytest

PATH = Path(__file__).parents[2] / "examples" / "train_with_torchrl.py"


def test_two_updates(example):
    done, again, other = (
        example.train(num_envs=4, steps=160, max_frames=1280, seed=seed) for seed in (0, 0, 1)
    )
    assert done.frames == 1280 and 0 < done.running_reward < 3
    assert all(p.isfinite().all() for p in done.network.parameters())
    assert done.running_reward == again.running_reward != other.running_reward


def test_it_stops_at_the_target(example):
    assert example.train(num_envs=4, steps=160, max_frames=9600, target=0.0).frames == 640


@pytest.mark.slow
def test_it_learns(example):
    """Acting at random collects 0.9 cubes; a running mean of 200 episodes differs by 0.05."""
    done = example.train(target=1.25, max_frames=99_200)
    assert done.running_reward >= 1.25 and done.frames < 99_200
