"""Models of camera faults, compared with closed forms and hand-computed values."""

import math

import pytest
import torch

from drone_rl.envs import fault_models


def noises(correlation_time, steps=400, pixels=5000):
    """Return an AR(1) process. Shape: (steps, pixels)."""
    draw = torch.Generator().manual_seed(0)
    now, seen = torch.randn(pixels, generator=draw), []
    for _ in range(steps):
        now = fault_models.correlate(now, torch.randn(pixels, generator=draw), correlation_time)
        seen.append(now)
    return torch.stack(seen)


@pytest.mark.parametrize("correlation_time", [0.0, 1.0, 19.5])
def test_noise_has_the_configured_variance_and_correlation(correlation_time):
    noise = noises(correlation_time)
    assert noise.mean().abs() < 0.02
    assert noise[0].var() == pytest.approx(1.0, abs=0.06)  # already in the first frame
    assert noise.var() == pytest.approx(1.0, abs=0.03)
    for lag in (1, 5):
        expected = math.exp(-lag / correlation_time) if correlation_time else 0.0
        assert (noise[lag:] * noise[:-lag]).mean() == pytest.approx(expected, abs=0.03)
    assert (noise[:, 1:] * noise[:, :-1]).mean().abs() < 0.01  # pixels are uncorrelated


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


def test_blur_does_not_depend_on_batch_size():
    images = torch.rand(7, 2, 9, 11, generator=torch.Generator().manual_seed(0))
    together = fault_models.blur(images, 1.3)
    for i in range(7):
        assert torch.equal(fault_models.blur(images[i : i + 1], 1.3)[0], together[i])


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


def test_dead_rows_are_constant():
    images = torch.full((1, 2, 3, 2), 0.5)
    dead = torch.tensor([[False, True, False]])
    killed = fault_models.dead_rows(1, level=0.25).show(images, dead, 0.0)
    assert killed.dtype == torch.float32
    assert killed[0, :, :, 0].tolist() == [[0.5, 0.25, 0.5]] * 2
    assert fault_models.dead_rows(1).show(images, dead, 0.0)[0, 0, 1].tolist() == [0.0, 0.0]


def test_frozen_images_are_the_previous_ones():
    now, before = torch.ones(2, 1, 1, 2), torch.zeros(2, 1, 1, 2)
    shown = fault_models.frozen_frames(0.5).update(before, now, fixed_source([0.4], [0.5]))
    assert shown.flatten().tolist() == [0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("frames", "shown"), [(0, [0, 1, 2, 3]), (2, [0, 0, 0, 1]), (9, [0, 0, 0, 0])]
)
def test_late_frames_repeat_the_first_image_until_the_second_arrives(frames, shown):
    fault, images = fault_models.late_frames(frames), torch.arange(4.0).reshape(4, 1, 1, 1, 1)
    memory = fault.begin(images[0], None)
    seen = [fault.show(images[0], memory, 0.0).item()]
    for image in images[1:]:
        memory = fault.update(memory, image, None)
        seen.append(fault.show(image, memory, 0.0).item())
    assert seen == shown


def test_shift_matches_hand_computed_images():
    image = torch.arange(6.0).reshape(1, 1, 2, 3).repeat(3, 1, 1, 1)
    by = torch.tensor([[0, 0], [1, 0], [-1, 2]])  # down, right
    stays, down, up_and_right = fault_models.shift(image, by)[:, 0].tolist()
    assert stays == [[0, 1, 2], [3, 4, 5]]
    assert down == [[0, 1, 2], [0, 1, 2]]
    assert up_and_right == [[3, 3, 3], [3, 3, 3]]
