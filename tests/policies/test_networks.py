import pytest
import torch
from torch import nn

from drone_rl.policies import MLP, ExternalNetwork, OriginalCNN, SmallCNN
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError


def test_actor_raises_for_non_finite_logits():
    network = MLP((1, 2, 2), 2, hidden=(2,))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.fill_(1e38)
        with pytest.raises(InputError, match="non-finite action logits"):
            network(torch.ones(1, 1, 2, 2))
    assert not network(torch.ones(1, 1, 2, 2)).isfinite().all()  # learners raise their own error


NETWORKS = [OriginalCNN, SmallCNN, MLP]


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("shape", [(1, 25, 64), (3, 40, 33), (2, 100, 256)])
def test_sizes_follow_from_the_image(network, shape):
    net = network(shape, 3)
    assert net.num_actions == 3
    assert net(torch.zeros(5, *shape)).shape == (5, 3)
    assert net(torch.zeros(shape)).shape == (3,)
    assert net(torch.zeros(2, 4, *shape)).shape == (2, 4, 3)


def test_original_cnn_has_the_published_shapes():
    net = OriginalCNN((1, 25, 64), 3)
    named = dict(net.layers.named_children())
    assert list(named) == [
        "conv1", "relu1", "pool1", "conv2", "relu2", "pool2", "flatten",
        "fc1", "fc_relu1", "fc2", "fc_relu2", "logits",
    ]  # fmt: skip
    shapes = [tuple(m.weight.shape) for m in named.values() if hasattr(m, "weight")]
    assert shapes == [(6, 1, 5, 5), (16, 6, 5, 5), (120, 624), (84, 120), (3, 84)]


@pytest.mark.parametrize("network", NETWORKS)
def test_weights_depend_only_on_the_generator(network):
    def build(seed):
        return network((1, 25, 64), 3, generator=torch.Generator().manual_seed(seed)).state_dict()

    first, again, other = build(0), build(0), build(1)
    assert all(torch.equal(first[k], again[k]) for k in first)
    assert not torch.equal(first["layers.logits.weight"], other["layers.logits.weight"])


@pytest.mark.parametrize("network", [SmallCNN, MLP])
def test_initial_policy_is_nearly_uniform(network):
    net = network((1, 25, 64), 3, generator=torch.Generator().manual_seed(0))
    probabilities = net(torch.randn(64, 1, 25, 64)).softmax(-1)
    assert (probabilities - 1 / 3).abs().max() < 0.1


def test_convolutions_are_he_normal():
    net = OriginalCNN((1, 25, 64), 3, channels=(64, 64), generator=torch.Generator().manual_seed(0))
    weight = net.layers.conv2.weight
    assert float(weight.detach().std()) == pytest.approx((2 / (64 * 25)) ** 0.5, rel=0.05)


@pytest.mark.parametrize("network", [OriginalCNN, SmallCNN])
def test_too_small_image_raises_with_the_smallest_size(network):
    with pytest.raises(InputError, match="2x2 pixels is too small") as error:
        network((1, 2, 2), 3)
    smallest = int(str(error.value).split("at least ")[1].split("x")[0])
    network((1, smallest, smallest), 3)


def test_image_of_another_size_raises():
    with pytest.raises(InputError, match="was built for"):
        SmallCNN((1, 25, 64), 3)(torch.zeros(1, 1, 30, 64))


def test_layers_have_orthogonal_gains():
    """The norm of rows of orthogonal weights is the gain."""
    network = SmallCNN((1, 25, 64), 3, generator=torch.Generator().manual_seed(0))
    for name, gain in (("conv1", 2**0.5), ("fc1", 2**0.5), ("logits", 0.01)):
        weight = network.layers.get_parameter(f"{name}.weight").flatten(1)
        torch.testing.assert_close(weight.norm(dim=1), torch.full((len(weight),), gain))
        assert not network.layers.get_parameter(f"{name}.bias").any()


def test_layers_follow_from_the_image_size():
    net = MLP((2, 3, 4), 3, hidden=(5, 6))
    named = dict(net.layers.named_children())
    assert list(named) == ["flatten", "fc1", "fc_relu1", "fc2", "fc_relu2", "logits"]
    shapes = [tuple(m.weight.shape) for m in named.values() if hasattr(m, "weight")]
    assert shapes == [(5, 24), (6, 5), (3, 6)]


X = torch.randn(7, 1, 12, 16, generator=torch.Generator().manual_seed(0))


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
