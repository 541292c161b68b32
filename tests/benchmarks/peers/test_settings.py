"""Settings are those of the programs that get them."""

import inspect

import pytest

from benchmarks.peers.program import PEERS
from benchmarks.peers.settings import LABELS, OURS, THEIRS


def test_everybody_has_settings_and_a_name():
    assert [*THEIRS] == [*PEERS] and [*LABELS] == [*OURS, *THEIRS]


def test_stable_baselines3_knows_its_settings():
    reason = "Stable-Baselines3 is not installed"
    sb3 = pytest.importorskip("stable_baselines3", reason=reason)
    for name, algorithm in (("sb3_ppo", sb3.PPO), ("sb3_a2c", sb3.A2C)):
        known = {*inspect.signature(algorithm).parameters, "num_envs"}
        assert {*THEIRS[name]} <= known
