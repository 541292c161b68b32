"""The trunk is the network without its last layer."""

import numpy as np
import pytest
import torch

from drone_rl.config.networks import Mlp, SmallCnn
from drone_rl.utils.errors import InputError

spaces = pytest.importorskip("gymnasium.spaces", reason="Gymnasium is not installed")
pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from drone_rl.policies.sb3 import Sb3Trunk  # noqa: E402 (after the skip)

IMAGES = spaces.Box(-np.inf, np.inf, (1, 25, 64), np.float32)


def test_trunk_has_the_layers_before_the_logits():
    trunk, network = Sb3Trunk(IMAGES), SmallCnn().make((1, 25, 64), 3)
    names = [name for name, _ in trunk.layers.named_children()]
    assert [*names, "logits"] == [name for name, _ in network.layers.named_children()]
    trunk.layers.load_state_dict(network.layers[:-1].state_dict())
    x = torch.randn(5, 1, 25, 64)
    assert trunk(x).shape == (5, 128) == (5, trunk.features_dim)
    torch.testing.assert_close(network.layers[-1](trunk(x)), network(x))


def test_other_networks_are_supported():
    assert Sb3Trunk(IMAGES, Mlp(hidden=(7, 5))).features_dim == 5
    assert Sb3Trunk(IMAGES, SmallCnn(channels=(4,), hidden=())).features_dim == 4 * 6 * 16


def test_vector_observations_raise():
    with pytest.raises(InputError, match=r"^Sb3Trunk got observations of shape \(28,\); give ima"):
        Sb3Trunk(spaces.Box(0, 1, (28,)))
