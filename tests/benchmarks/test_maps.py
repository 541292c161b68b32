"""Networks whose true heat map is known, and maps that ignore the policy."""

import pytest
import torch

from benchmarks.known_map_policies import make_policies, path_weights
from drone_rl.explanations.hooks import probabilities
from drone_rl.policies import MLP

SIZE = (25, 64)


@pytest.fixture(scope="module")
def images():
    """Return the empty scene, random images, and targets that depend on the window "left"."""
    generator = torch.Generator().manual_seed(0)
    absent = torch.full((1, *SIZE), 0.5)
    absent[:, 12:] = -0.3
    x = absent + 0.7 * torch.randn(60, 1, *SIZE, generator=generator)
    brightness = x[:, 0, 8:18, 4:20].mean((1, 2))
    return absent, x, (brightness > brightness.median()).long()


def test_path_weights_sum_over_paths():
    network = MLP((1, 1, 2), 2, hidden=(2,))
    with torch.no_grad():
        network.layers.fc1.weight.copy_(torch.tensor([[1.0, -2.0], [-3.0, 0.0]]))
        network.layers.fc1.bias.fill_(-100.0)
        network.layers.logits.weight.copy_(torch.tensor([[1.0, 0.5], [-1.0, -0.5]]))
    # pixel 0: 2 (1) + 1 (3), pixel 1: 2 (2)
    assert path_weights(network, torch.zeros(1, 1, 1, 2), torch.zeros(1)).tolist() == [[[5.0, 4.0]]]


def test_a_policy_depends_on_pixels_with_nonzero_path_weights_only(images):
    x = images[1]
    policies = make_policies(*images)
    assert sum(not policy.is_blind for policy in policies) >= 24
    for policy in policies:
        relevant = path_weights(policy.network, x[:1], torch.zeros(1))[0] > 0
        before, other = probabilities(policy.network, x), x + torch.randn_like(x)
        outside = probabilities(policy.network, torch.where(relevant, x, other))
        inside = probabilities(policy.network, torch.where(relevant, other, x))
        assert torch.allclose(before, outside, atol=1e-6), policy.name
        moved = 0.5 * (before - inside).abs().sum(-1).max()
        assert (moved < 1e-6) if policy.is_blind else (moved > 1e-3), policy.name
