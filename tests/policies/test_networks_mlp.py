import torch

from drone_rl.policies import MLP


def test_layers_follow_from_the_image_size():
    net = MLP((2, 3, 4), 3, hidden=(5, 6))
    named = dict(net.layers.named_children())
    assert list(named) == ["flatten", "fc1", "fc_relu1", "fc2", "fc_relu2", "logits"]
    shapes = [tuple(m.weight.shape) for m in named.values() if hasattr(m, "weight")]
    assert shapes == [(5, 24), (6, 5), (3, 6)]


def test_network_without_hidden_layers_is_linear():
    net = MLP((1, 1, 2), 3, hidden=())
    with torch.no_grad():
        net.layers.logits.weight.copy_(torch.tensor([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]))
    assert net(torch.tensor([[[2.0, 5.0]]])).tolist() == [2.0, 5.0, 7.0]


def test_layers_have_orthogonal_gains():
    net = MLP((1, 4, 4), 3, hidden=(8,), generator=torch.Generator().manual_seed(0))
    hidden, last = net.layers.fc1.weight, net.layers.logits.weight
    assert torch.allclose(hidden @ hidden.T, 2 * torch.eye(8), atol=1e-5)
    assert torch.allclose(last @ last.T, 1e-4 * torch.eye(3), atol=1e-8)
    assert not net.layers.fc1.bias.any()
