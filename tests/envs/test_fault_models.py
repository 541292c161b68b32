"""Models of camera faults, compared with closed forms and hand-computed values."""

import pytest
import torch

from drone_rl.envs import fault_models


def test_noise_is_clipped_at_black_and_white():
    images = torch.tensor([0.1, 0.5, 0.9]).reshape(1, 1, 3)
    noise = torch.tensor([-1.0, 0.5, 1.0]).reshape(1, 1, 3)
    noisy = fault_models.noise(0.2).show(images, noise, 0.0)
    torch.testing.assert_close(noisy.flatten(), torch.tensor([0.0, 0.6, 1.0]))
    assert torch.equal(fault_models.noise(0.0).show(images, noise, 0.0), images)


@pytest.mark.parametrize("width", [0.3, 0.5, 2.0])
def test_blur_turns_a_bright_pixel_into_a_gaussian(width):
    image = torch.zeros(1, 41, 51)
    image[0, 20, 25] = 1.0
    blurred = fault_models.blur(image, width)[0]
    down, across = torch.meshgrid(torch.arange(41) - 20, torch.arange(51) - 25, indexing="ij")
    falls = torch.exp(-(down**2 + across**2).double() / (2 * width**2))
    torch.testing.assert_close(blurred, (falls / falls.sum()).float(), atol=2e-5, rtol=0)
    if width == 2.0:
        assert float((blurred * down**2).sum()) == pytest.approx(4.0, rel=0.01)


def test_blur_replicates_the_border():
    image = torch.tensor([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).reshape(1, 1, 6)
    weights = fault_models.gaussian(0.5)  # two pixels on each side
    expected = [weights[0] + weights[1] + weights[2], weights[1] + weights[0], weights[0], 0, 0, 0]
    torch.testing.assert_close(fault_models.blur(image, 0.5).flatten(), torch.tensor(expected))


def fixed_source(*values):
    """Return a random source that always gives the same values."""
    return lambda *shape, normal=False: torch.tensor(values)


def test_more_dead_rows_include_the_fewer():
    sample = fixed_source([0.4, 0.1, 0.9, 0.3], [0.2, 0.3, 0.1, 0.8])
    images = torch.zeros(2, 1, 4, 3)
    models = [fault_models.dead_rows(count) for count in range(5)]
    chosen = [model.begin(images, sample).int().tolist() for model in models]
    assert chosen[0] == [[0, 0, 0, 0], [0, 0, 0, 0]]
    assert chosen[1] == [[0, 1, 0, 0], [0, 0, 1, 0]]
    assert chosen[2] == [[0, 1, 0, 1], [1, 0, 1, 0]]
    assert chosen[4] == [[1, 1, 1, 1], [1, 1, 1, 1]]
    always = fault_models.dead_rows(1, rows=(2,)).begin(images, sample).int().tolist()
    assert always == [[0, 1, 1, 0], [1, 0, 1, 0]]


def test_shift_matches_hand_computed_images():
    image = torch.arange(6.0).reshape(1, 1, 2, 3).repeat(3, 1, 1, 1)
    by = torch.tensor([[0, 0], [1, 0], [-1, 2]])  # down, right
    stays, down, up_and_right = fault_models.shift(image, by)[:, 0].tolist()
    assert stays == [[0, 1, 2], [3, 4, 5]]
    assert down == [[0, 1, 2], [0, 1, 2]]
    assert up_and_right == [[3, 3, 3], [3, 3, 3]]
