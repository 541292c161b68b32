"""Behavior common to all networks."""

import pytest
import torch
from torch import nn

from drone_rl.policies import MLP, ExternalNetwork, ImageNetwork, SmallCNN
from drone_rl.sim.actions import MOVES

X = torch.randn(7, 1, 12, 16, generator=torch.Generator().manual_seed(0))


def test_base_class_raises_not_implemented():
    network = ImageNetwork()
    assert (network.num_actions, network.parts, network.is_differentiable) == (3, network, True)
    assert not network.has_weights
    for ask in (lambda: network(X), lambda: network.rescale(X, X)):
        with pytest.raises(NotImplementedError):
            ask()


@pytest.mark.parametrize(
    "network",
    [
        SmallCNN((1, 12, 16), 3, channels=(4,), hidden=(8,)),
        MLP((1, 12, 16), 3),
        ExternalNetwork(nn.Sequential(nn.Flatten(), nn.Linear(192, 3)), (1, 12, 16), MOVES),
        ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 12, 16), MOVES),
    ],
    ids=lambda network: type(network).__name__,
)
def test_rescale_can_be_repeated(network):
    before = network(X)
    factor, shift = torch.tensor([2.0, -1.0, 0.5]), torch.tensor([0.0, 10.0, 1.0])
    network.rescale(factor, shift)
    torch.testing.assert_close(network(X), factor * before + shift)
    network.rescale(factor, shift)
    torch.testing.assert_close(network(X), factor * (factor * before + shift) + shift)
