"""Batched inference equals torch, also with concurrent calls."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import torch

from drone_rl.acceleration.inference_kernel import BatchedInference
from drone_rl.policies import MLP, SmallCNN
from drone_rl.utils.errors import InputError


@pytest.fixture
def network():
    made = SmallCNN((1, 25, 64), 3, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        made.layers.logits.weight.mul_(300)
    return made


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 50])
def test_logits_equal_the_network(network, count):
    images = torch.randn(count, 1, 25, 64)
    found, expected = BatchedInference(network)(images), network(images)
    assert found.shape == (count, 3) and not found.requires_grad
    assert torch.allclose(found, expected, atol=1e-4)
    assert count == 0 or expected.abs().max() > 1


def test_logits_do_not_depend_on_other_images_of_the_batch(network):
    logits_of, images = BatchedInference(network), torch.randn(40, 1, 25, 64)
    whole = logits_of(images)
    assert torch.equal(torch.cat([logits_of(image[None]) for image in images]), whole)
    assert torch.equal(logits_of(images.flip(0)).flip(0), whole)


def test_threads_use_separate_buffers(network):
    logits_of, parts = BatchedInference(network), torch.randn(8, 200, 1, 25, 64)
    expected = [logits_of(part) for part in parts]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(logits_of, parts))
    assert all(torch.equal(one, other) for one, other in zip(expected, found, strict=True))


def test_other_networks_are_not_supported():
    found = BatchedInference.try_create(MLP((1, 25, 64), 3))
    assert found == ("network MLP is not fused",)


def test_logits_behind_a_first_layer_of_more_outputs():
    generator = torch.Generator().manual_seed(0)
    wide = SmallCNN((1, 25, 64), 3, channels=(40,), hidden=(), generator=generator)
    frames = torch.randn(18, 1, 25, 64)
    assert torch.allclose(BatchedInference(wide)(frames), wide(frames), atol=1e-5)


def test_images_of_another_shape_raise_as_by_the_network(network):
    with pytest.raises(InputError, match="built for images of shape"):
        BatchedInference(network)(torch.zeros(3, 1, 12, 64))
