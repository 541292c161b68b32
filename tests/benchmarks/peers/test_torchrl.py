"""Training with TorchRL's collector by the example of the repository."""

import pytest

from benchmarks.peers import torchrl
from benchmarks.peers.torchrl import train_torchrl
from drone_rl.utils.errors import InputError


def test_training_stops_at_frames_or_target_and_returns_a_policy():
    done = train_torchrl(3, max_frames=640, num_envs=4, steps=160)
    assert (done.is_solved, done.frames) == (False, 640)
    assert [reward > 0 for _, reward in done.history] == [True]
    network = done.policy.make_network()
    assert network.in_shape == (1, 25, 64) and done.policy.name == "torchrl's Collector"
    assert train_torchrl(3, target=0.0, num_envs=2, steps=160).is_solved


def test_a_missing_example_is_an_error(monkeypatch, tmp_path):
    monkeypatch.setattr(torchrl, "EXAMPLE", tmp_path / "none.py")
    with pytest.raises(InputError, match=r"none\.py does not exist; run the benchmark in a clone"):
        train_torchrl(0)
