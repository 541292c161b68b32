"""External callables as networks."""

import pytest
import torch
from torch import nn

from drone_rl.policies import ExternalNetwork
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError

SHAPE = (1, 2, 4)
"""Shape of one image."""


def left_half(x):
    """Return logits: the mean of the image, of its left half and of its right half."""
    mean = x.flatten(1).mean(1)
    return torch.stack([mean, x[..., :2].flatten(1).mean(1), x[..., 2:].flatten(1).mean(1)], 1)


def make(logits, shape=SHAPE, **kwargs):
    return ExternalNetwork(logits, shape, MOVES, **kwargs)


def test_function_of_images_is_a_network():
    network = make(left_half)
    image = torch.tensor([[[0.0, 2.0, 4.0, 6.0], [0.0, 2.0, 4.0, 6.0]]])
    assert network(image).tolist() == [3.0, 1.0, 5.0]
    assert network(image.expand(2, 5, *SHAPE)).shape == (2, 5, 3)
    assert (network.in_shape, network.num_actions, network.is_differentiable) == (SHAPE, 3, True)
    assert not [*network.parts.children()] and not network.has_weights


def test_numpy_logits_are_accepted_without_gradients():
    network = make(lambda x: left_half(x).detach().numpy())
    assert not network.is_differentiable
    assert network(torch.ones(1, *SHAPE)).tolist() == [[1.0, 1.0, 1.0]]


def test_function_without_gradients_is_not_differentiable():
    assert not make(torch.no_grad()(left_half)).is_differentiable
    weight = nn.Parameter(torch.zeros(1, 3))
    assert not make(lambda x: weight.expand(len(x), 3)).is_differentiable  # ignores its input


def test_byte_images_are_passed_unchanged():
    seen = []

    def note(x):
        seen.append(x)
        return x.float().mean((1, 2))

    network = make(note, (3, 2, 4), takes_bytes=True)
    frames = torch.arange(256, dtype=torch.uint8)[:192].reshape(8, 2, 4, 3)
    images = frames.movedim(-1, 1).float() / 255
    network(images)
    assert torch.equal(seen[-1], frames)
    assert not network.is_differentiable


def test_module_is_copied_in_eval_mode():
    module = nn.Sequential(nn.Dropout(0.5), nn.ReLU(inplace=True), nn.Flatten(), nn.Linear(8, 3))
    network = make(module)
    assert module.training and module[1].inplace
    image = torch.randn(4, *SHAPE)
    before = network(image)
    with torch.no_grad():
        module[3].weight.zero_()
    assert torch.equal(network(image), before)
    module.eval()
    assert not torch.equal(module(image), before)
    assert network.has_weights
    assert [type(part) for part in network.parts] == [nn.Dropout, nn.ReLU, nn.Flatten, nn.Linear]


@pytest.mark.parametrize(
    ("logits", "message"),
    [
        (nn.Linear(7, 3), r"failed in Linear on images of shape \(1, 1, 2, 4\)"),
        (lambda x: 1 / 0, r"failed in line \d+ of .*test_external_network\.py"),
        (lambda x: left_half(x)[:, :2], r"returned a Tensor of shape \(1, 2\)"),
        (lambda x: left_half(x).argmax(-1), r"returned a Tensor of shape \(1,\)"),
        (lambda x: (left_half(x), x), "returned a tuple"),
        (lambda x: left_half(x) / 0 * 0, "returned logits that are not finite"),
        (lambda x: torch.rand(len(x), 3), "returned different logits for one image"),
    ],
)
def test_invalid_logits_raise(logits, message):
    with pytest.raises(InputError, match=f"^the network {message}") as caught:
        make(logits)
    assert "\n" not in str(caught.value)


def test_a_later_failure_raises():
    """As of an ONNX model that was exported with a batch of one."""

    def logits(x):
        return left_half(x.reshape(1, *SHAPE))

    network = make(logits)
    with pytest.raises(InputError, match=r"on images of shape \(2, 1, 2, 4\).*RuntimeError"):
        network(torch.ones(2, *SHAPE))


def test_uncopyable_module_raises():
    module = nn.Flatten()
    module.held = torch.ones(1, requires_grad=True) * 2  # not a leaf, and torch copies only leaves
    with pytest.raises(InputError, match=r"^the network Flatten can't be copied .* function that"):
        make(module)
