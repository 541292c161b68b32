"""Runs the example in a short version."""

from pathlib import Path

PATH = Path(__file__).parents[2] / "examples" / "train_with_torchrl.py"


def test_two_updates(example):
    done, again = (example.train(num_envs=4, steps=160, max_frames=1280) for _ in range(2))
    assert done.frames == 1280 and 0 < done.running_reward < 3
    assert all(p.isfinite().all() for p in done.network.parameters())
    assert done.running_reward == again.running_reward


def test_it_stops_at_the_target(example):
    assert example.train(num_envs=4, steps=160, max_frames=9600, target=0.0).frames == 640
