"""A network asked by kernels answers as it does by torch, whoever asks at the same time."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import torch

from drone_rl.acceleration.inference_kernel import BatchedInference
from drone_rl.policies import OriginalCNN, SmallCNN


@pytest.fixture
def network():
    made = SmallCNN((1, 25, 64), 3, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        made.layers.logits.weight.mul_(300)
    return made


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 50])
def test_logits_are_the_networks(network, count):
    pictures = torch.randn(count, 1, 25, 64)
    found, expected = BatchedInference(network)(pictures), network(pictures)
    assert found.shape == (count, 3) and not found.requires_grad
    assert torch.allclose(found, expected, atol=1e-4)
    assert count == 0 or expected.abs().max() > 1


def test_an_answer_does_not_depend_on_the_pictures_beside_it(network):
    answers, pictures = BatchedInference(network), torch.randn(40, 1, 25, 64)
    whole = answers(pictures)
    assert torch.equal(torch.cat([answers(picture[None]) for picture in pictures]), whole)
    assert torch.equal(answers(pictures.flip(0)).flip(0), whole)


def test_threads_have_buffers_of_their_own(network):
    answers, parts = BatchedInference(network), torch.randn(8, 200, 1, 25, 64)
    expected = [answers(part) for part in parts]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(answers, parts))
    assert all(torch.equal(one, other) for one, other in zip(expected, found, strict=True))


def test_other_networks_are_not_supported():
    found = BatchedInference.try_create(OriginalCNN((1, 25, 64), 3))
    assert found == ("network OriginalCNN is not fused",)
