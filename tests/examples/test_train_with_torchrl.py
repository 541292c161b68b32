"""Runs the example in a short version."""

from pathlib import Path

PATH = Path(__file__).parents[2] / "examples" / "train_with_torchrl.py"


def test_it_learns_until_the_target(example):
    done = example.train(num_envs=4, steps=160, max_frames=1280)
    assert done.frames == 1280 and 0 < done.running_reward < 3
    assert all(p.isfinite().all() for p in done.network.parameters())
    assert example.train(num_envs=4, steps=160, max_frames=1280, target=0.0).frames == 640
