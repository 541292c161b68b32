"""Settings exist in the libraries that get them."""

import inspect

import pytest

from benchmarks.peers.program import PEERS
from benchmarks.peers.settings import LABELS, OURS, THEIRS


def test_every_learner_has_settings_and_a_label():
    assert [*THEIRS] == [*PEERS] and [*LABELS] == [*OURS, *THEIRS]


def test_settings_are_parameters_of_stable_baselines3():
    reason = "Stable-Baselines3 is not installed"
    sb3 = pytest.importorskip("stable_baselines3", reason=reason)
    for name, algorithm in (("sb3_ppo", sb3.PPO), ("sb3_a2c", sb3.A2C)):
        known = {*inspect.signature(algorithm).parameters, "num_envs"}
        assert {*THEIRS[name]} <= known
