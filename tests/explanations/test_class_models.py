"""Observations optimized for each action: ascent, search, and the command."""

from types import SimpleNamespace

import pytest
import torch

import drone_rl
from drone_rl.explanations.class_model_gallery import GALLERY
from drone_rl.explanations.class_models import (
    ClassModelSettings,
    _Ascent,
    best_models,
    gaussian_blur,
    image_statistics,
    most_probable,
    optimize,
    section,
)
from drone_rl.explanations.context import find_lacking
from drone_rl.explanations.results import ImageStatistics
from drone_rl.policies import MLP
from drone_rl.utils.errors import InputError

STATISTICS = ImageStatistics(mean=0.0, std=1.0, low=-2.0, high=2.0, roughness=0.5)


@pytest.fixture
def halves():
    """A policy that goes left if the left half is dark, right if the right one is, else ahead."""
    network = MLP((1, 6, 12), 3, hidden=())
    weight = torch.zeros(3, 6, 12)
    weight[1, :, :6], weight[2, :, 6:] = -0.2, -0.2
    with torch.no_grad():
        network.layers.logits.weight.copy_(weight.flatten(1))
    return network


@pytest.mark.parametrize("parameterisation", ["pixel", "fourier"])
@pytest.mark.parametrize("objective", ["probability", "logit"])
def test_images_show_what_the_policy_responds_to(halves, parameterisation, objective):
    settings = ClassModelSettings(
        maximize=objective, parameterisation=parameterisation, blur=0.5, steps=64, starts=2
    )
    images = optimize(halves, STATISTICS, settings, seed=3)
    left, right = images[1, :, 0], images[2, :, 0]
    assert (left[..., :6].mean((1, 2)) < left[..., 6:].mean((1, 2)) - 0.5).all()
    assert (right[..., 6:].mean((1, 2)) < right[..., :6].mean((1, 2)) - 0.5).all()
    found = best_models(halves, STATISTICS, [settings], seed=3)
    assert min(found.probabilities[1:]) > 0.99
    reached = halves(torch.from_numpy(found.images)).softmax(-1).diagonal()
    assert found.probabilities == pytest.approx(reached.tolist())


def test_the_same_seed_gives_the_same_image_and_the_policy_is_unchanged(halves):
    before = {k: v.clone() for k, v in halves.state_dict().items()}
    settings = ClassModelSettings(steps=5, starts=2)
    images = [optimize(halves, STATISTICS, settings, seed=s) for s in (1, 1, 2)]
    assert torch.equal(images[0], images[1]) and not torch.equal(images[0], images[2])
    assert all(torch.equal(before[k], v) for k, v in halves.state_dict().items())
    assert all(p.grad is None for p in halves.parameters())


def test_best_start_is_the_most_probable_then_the_smoothest():
    probabilities = torch.tensor([[0.5, 0.8, 0.7], [0.995, 0.999, 0.98], [0.3, 0.3, 0.1]])
    roughness = torch.tensor([[0.1, 9.0, 0.1], [2.0, 3.0, 1.0], [2.0, 1.0, 0.5]])
    found = most_probable(probabilities, roughness)
    assert found == [1, 0, 1]  # within a hundredth: the smoother


def test_an_action_that_no_image_reaches_has_a_low_probability():
    """Action 1 can't win: its logit is far below. Its picture is still the best there is."""
    network = MLP((1, 6, 12), 3, hidden=())
    with torch.no_grad():
        network.layers.logits.bias.copy_(torch.tensor([0.0, -20.0, 0.0]))
    tried = [ClassModelSettings(steps=8, blur=blur, starts=3) for blur in (0.5, 0.9)]
    found = best_models(network, STATISTICS, tried)
    assert found.highest[1] < 0.01 and found.highest[0] > 0.45
    assert found.attempts == 2 * 3


def test_statistics_by_hand():
    """Columns 0 1 0 1: neighbours across differ by 1, those down by 0; the data set's by 2."""
    stripes = torch.tensor([0.0, 1.0]).repeat(3).expand(1, 1, 4, 6)
    statistics = image_statistics(2 * stripes)
    assert (statistics.mean, statistics.low, statistics.high, statistics.roughness) == (1, 0, 2, 2)
    assert statistics.std == pytest.approx((24 / 23) ** 0.5)
    rows = stripes.mT.contiguous()
    assert image_statistics(rows).roughness == 1.0
    assert image_statistics(torch.cat([stripes, 0 * stripes])).roughness == 0.5


PLAIN = ClassModelSettings(steps=1, jitter=0, starts=1)
WIDE = ImageStatistics(mean=0.3, std=2.0, low=-100.0, high=100.0, roughness=0.5)


@pytest.fixture
def unrefined(monkeypatch):
    monkeypatch.setattr(_Ascent, "refine", lambda self, images: images)


def constant(*logits):
    """A policy that sees nothing."""
    network = MLP((1, 6, 12), 3, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.bias.copy_(torch.tensor(logits))
    return network


def test_objectives_by_hand():
    """Logits 1, 2 and 4; stripes of 0 and 1 have differences 1."""
    stripes = torch.tensor([0.0, 1.0]).repeat(6).expand(2, 1, 6, 12)
    actions = torch.tensor([0, 2])

    def value(objective):
        settings = ClassModelSettings(maximize=objective, jitter=0)
        network = constant(1.0, 2.0, 4.0)
        return _Ascent(network, actions, WIDE, settings, torch.Generator()).value(stripes).tolist()

    assert value("logit") == pytest.approx([1 - 7 / 3, 4 - 7 / 3])
    odds = torch.tensor([1.0, 2.0, 4.0]).softmax(0)
    assert value("probability") == pytest.approx([float(odds[0]), float(odds[2])])


def test_a_step_on_the_pixels_by_hand(halves, unrefined):
    """A tenth of the rate times the deviation, along the gradient: left is the dark left half."""
    start = torch.zeros(1, 1, 6, 12)
    found = _Ascent(halves, torch.tensor([1]), WIDE, PLAIN, torch.Generator()).pixels(start)
    gradient = torch.zeros(6, 12)  # logit 1 less the mean of all three
    gradient[:, :6], gradient[:, 6:] = -0.2 + 0.2 / 3, 0.2 / 3
    expected = PLAIN.lr * WIDE.std / 10 * gradient / gradient.norm()
    torch.testing.assert_close(found[0, 0], expected)
    plain = PLAIN.replace(step="plain", lr=3.0)
    found = _Ascent(halves, torch.tensor([1]), WIDE, plain, torch.Generator()).pixels(start)
    torch.testing.assert_close(found[0, 0], 3.0 * gradient)


def test_blur_by_hand():
    flat = torch.full((1, 2, 5, 5), 3.0)
    torch.testing.assert_close(gaussian_blur(flat, 1.0), flat)
    spot = torch.zeros(1, 1, 9, 9)
    spot[..., 4, 4] = 1
    blurred = gaussian_blur(spot, 0.8)
    assert blurred.sum() == pytest.approx(1.0, abs=1e-5)
    kernel = torch.exp(-(torch.tensor([2.0, 1.0, 0.0, 1.0, 2.0]) ** 2) / (2 * 0.64))
    kernel /= kernel.sum()  # 2.4 deviations' pixels, rounded, on each side
    torch.testing.assert_close(blurred[0, 0, 2:7, 2:7], kernel[:, None] * kernel)
    assert blurred[0, 0, 1].abs().sum() == 0
    two = torch.cat([spot, 2 * spot], 1)
    torch.testing.assert_close(gaussian_blur(two, 0.8), torch.cat([blurred, 2 * blurred], 1))
    assert gaussian_blur(spot, 0.1)[0, 0, 4, 4] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"normalize": "training_set"}, [[-1.0, 1.0]]),  # (x - 0.3) / 2
        ({"normalize": "none"}, [[-1.7, 2.3]]),
        ({"normalize": "none", "clamp": True}, [[-1.0, 2.0]]),
    ],
)
def test_refinements_by_hand(changes, expected):
    images = torch.tensor([[-1.7, 2.3]])[None, None]
    statistics = WIDE.model_copy(update={"low": -1.0, "high": 2.0})
    settings = ClassModelSettings(**{"blur": 0.0, "clamp": False, **changes})
    found = _Ascent(None, None, statistics, settings, None).refine(images)
    torch.testing.assert_close(found[0, 0], torch.tensor(expected), rtol=1e-5, atol=1e-5)


def test_without_gradients_they_are_left_out():
    network = SimpleNamespace(is_differentiable=False)
    lacking = find_lacking({"class_model": section}, SimpleNamespace(network=network))
    assert "this policy has none; give it as a PyTorch function" in lacking["class_model"]


@pytest.fixture(scope="module")
def found():
    return drone_rl.class_models("good", steps=4, starts=2, episodes=2, seed=0)


def test_the_result_has_a_row_of_probabilities(found):
    header, row = found.rows()
    assert header == ["settings", "left", "forward", "right"]
    assert row[0] == "given settings" and all(0 <= float(cell) <= 1 for cell in row[1:])
    assert "left" in str(found) and "seed 0" in str(found)
    assert "<img" in found._repr_html_()


def test_gallery_shows_each_refinement():
    found = drone_rl.class_models("poor", gallery=True, episodes=2, seed=0)
    assert list(found.tried) == list(GALLERY)
    (first, _), *_, (last, _) = found.tried.values()
    assert first.maximize == "probability" and first.blur == 0.0
    assert last == drone_rl.ClassModelsSettings().as_base(type(last))
    failed = "defaults: no image found makes forward or right more probable than not"
    assert failed in str(found) and failed in found._repr_html_()
    width, height = found.figure().size
    assert height > len(GALLERY) * 25 and width > 3 * 64


def test_images_that_diverge_are_an_error():
    with pytest.raises(InputError, match="lr=1e\\+09 the images diverge"):
        drone_rl.class_models(
            "good", step="plain", lr=1e9, clamp=False, normalize="none", l2=1.0, episodes=1, seed=0
        )
