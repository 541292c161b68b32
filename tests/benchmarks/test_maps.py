"""Networks whose true heat map is known, and maps that ignore the policy."""

import pytest
import torch

from benchmarks.adversarial_maps import adversarial_maps
from benchmarks.known_map_policies import make_policies, path_weights
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.patches import placebo_maps
from drone_rl.policies import MLP, SmallCNN

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


def test_adversarial_maps_differ_from_placebos_and_from_each_other(images):
    absent, x, _ = images
    x, actions = x[:3], torch.tensor([0, 1, 2])
    network, other = (
        SmallCNN((1, *SIZE), 3, generator=torch.Generator().manual_seed(seed)) for seed in (0, 1)
    )
    maps = {n: f(network, x, actions) for n, f in adversarial_maps(absent, other).items()}
    assert len(maps) >= 20
    maps |= {f"placebo {n}": m for n, m in placebo_maps(x, absent, [x + 1, -x]).items()}
    flat = {n: heat.expand(3, -1, -1).flatten() / heat.max() for n, heat in maps.items()}
    names = list(flat)
    for i, first in enumerate(names):
        assert maps[first].min() >= 0 and torch.isfinite(maps[first]).all(), first
        for second in names[:i]:
            assert not torch.allclose(flat[first], flat[second], atol=1e-3), (first, second)
