import torch

from benchmarks.adversarial_maps import adversarial_maps, fingerprint, saliency
from drone_rl.explanations.patches import placebo_maps
from drone_rl.policies import MLP, SmallCNN

SIZE = (1, 25, 64)


def make_inputs():
    absent = torch.zeros(SIZE)
    absent[:, :12] = 1.0
    x = absent.repeat(3, 1, 1, 1)
    x[:, 0, 8:16, 20:30] = -1.0
    network = SmallCNN(SIZE, 3, generator=torch.Generator().manual_seed(0))
    other = SmallCNN(SIZE, 3, generator=torch.Generator().manual_seed(1))
    return absent, x, network, other


def test_adversarial_maps_differ_from_placebos_and_from_each_other():
    absent, x, network, other = make_inputs()
    actions = torch.tensor([0, 1, 2])
    maps = {n: f(network, x, actions) for n, f in adversarial_maps(absent, other).items()}
    assert len(maps) >= 20
    maps |= {f"placebo {n}": m for n, m in placebo_maps(x, absent, [x + 1, -x]).items()}
    flat = {n: m.expand(3, -1, -1).flatten() / m.max() for n, m in maps.items()}
    names = list(flat)
    for name, m in maps.items():
        assert m.shape == (3, 25, 64) and m.min() >= 0 and torch.isfinite(m).all(), name
    for i, first in enumerate(names):
        for second in names[:i]:
            assert not torch.allclose(flat[first], flat[second], atol=1e-3), (first, second)


def test_some_maps_change_with_every_weight_and_some_with_none():
    absent, x, network, other = make_inputs()
    actions = torch.tensor([0, 1, 2])
    found = adversarial_maps(absent, other)
    before = {n: f(network, x, actions) for n, f in found.items()}
    assert fingerprint(network) == fingerprint(network)
    with torch.no_grad():
        network.layers.fc1.bias[3] += 1e-6
    changed = {n for n, f in found.items() if not torch.equal(before[n], f(network, x, actions))}
    assert {n for n in found if "of the weights" in n} <= changed
    assert "saliency of shuffled weights" in changed
    assert not changed & {"edges", "cube detector", "saliency of another policy"}


def test_saliency_by_hand():
    network = MLP((1, 1, 2), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.copy_(torch.tensor([[1.0, -2.0], [3.0, 0.0]]))
    found = saliency(network, torch.zeros(2, 1, 1, 2), torch.tensor([0, 1]))
    assert found.tolist() == [[[1.0, 2.0]], [[3.0, 0.0]]]
