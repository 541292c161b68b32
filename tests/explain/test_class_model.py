import dataclasses

import pytest
import torch

from drone_rl.explain.class_model import (
    ClassModelSettings,
    PictureStatistics,
    gaussian_blur,
    search,
    visualise,
)
from drone_rl.policies import MLP
from drone_rl.utils.errors import InputError

STATISTICS = PictureStatistics(mean=0.0, std=1.0, low=-2.0, high=2.0, roughness=0.5)


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
def test_pictures_show_what_the_policy_waits_for(halves, parameterisation, objective):
    settings = ClassModelSettings(
        objective=objective, parameterisation=parameterisation, blur=0.5, steps=64, starts=2
    )
    found = visualise(halves, STATISTICS, settings, seed=3)
    left, right = found.pictures[1, 0], found.pictures[2, 0]
    assert left[:, :6].mean() < left[:, 6:].mean() - 0.5
    assert right[:, 6:].mean() < right[:, :6].mean() - 0.5
    assert found.probabilities[1] > 0.99 and found.probabilities[2] > 0.99
    reached = halves(found.pictures).softmax(-1).diagonal()
    torch.testing.assert_close(found.probabilities, reached.detach())


def test_the_same_seed_gives_the_same_picture_and_the_policy_is_left_alone(halves):
    before = {k: v.clone() for k, v in halves.state_dict().items()}
    settings = ClassModelSettings(steps=5, starts=2)
    pictures = [visualise(halves, STATISTICS, settings, seed=s).pictures for s in (1, 1, 2)]
    assert torch.equal(pictures[0], pictures[1]) and not torch.equal(pictures[0], pictures[2])
    assert all(torch.equal(before[k], v) for k, v in halves.state_dict().items())
    assert all(p.grad is None for p in halves.parameters())


def test_pictures_keep_to_the_range_of_real_ones(halves):
    found = visualise(halves, STATISTICS, ClassModelSettings(steps=20, starts=2))
    assert found.pictures.min() >= STATISTICS.low and found.pictures.max() <= STATISTICS.high


def test_a_search_notes_everything_it_tried(halves):
    best, tried = search(halves, STATISTICS)
    assert len(tried) == 6 and sum(row["chosen"] for row in tried) == 1
    chosen = next(row for row in tried if row["chosen"])
    assert chosen["merit"] == max(row["merit"] for row in tried)
    assert chosen["probabilities"] == best.probabilities.tolist()
    assert dataclasses.asdict(best.settings).items() <= chosen.items()


def test_a_blur_keeps_flat_pictures_and_their_mean():
    flat = torch.full((1, 2, 5, 5), 3.0)
    torch.testing.assert_close(gaussian_blur(flat, 1.0), flat)
    spot = torch.zeros(1, 1, 9, 9)
    spot[..., 4, 4] = 1
    blurred = gaussian_blur(spot, 0.8)
    assert blurred.sum() == pytest.approx(1.0, abs=1e-5)
    assert blurred[0, 0, 4, 4] > blurred[0, 0, 4, 5] > blurred[0, 0, 4, 6]


@pytest.mark.parametrize(
    "wrong", [{"objective": "x"}, {"parameterisation": "x"}, {"lr": 0.0}, {"blur": -1.0}]
)
def test_bad_settings_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        ClassModelSettings(**wrong)
