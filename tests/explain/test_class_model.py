import pytest
import torch

from drone_rl.explain.class_model import (
    Attempts,
    ClassModel,
    ClassModelSettings,
    PictureStatistics,
    best_start,
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
    left, right = found.pictures[1, :, 0], found.pictures[2, :, 0]
    assert (left[..., :6].mean((1, 2)) < left[..., 6:].mean((1, 2)) - 0.5).all()
    assert (right[..., 6:].mean((1, 2)) < right[..., :6].mean((1, 2)) - 0.5).all()
    assert (found.probabilities[1:] > 0.99).all()
    for action in range(3):
        reached = halves(found.pictures[action]).softmax(-1)[:, action]
        torch.testing.assert_close(found.probabilities[action], reached.detach())


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


def made(probabilities, roughness, value):
    """What a setting made of two starts, for two actions; the pictures' pixels number them."""
    pictures = value + torch.arange(4.0).view(2, 2, 1, 1, 1)
    settings = ClassModelSettings(starts=2)
    return Attempts(pictures, torch.tensor(probabilities), torch.tensor(roughness), settings)


def test_picture_is_the_best_starts_never_an_average():
    tried = [
        made([[0.2, 0.7], [0.1, 0.3]], [[0.1, 1.0], [1.0, 1.0]], 0),
        made([[0.6, 0.1], [0.4, 0.2]], [[1.0, 1.0], [1.0, 2.0]], 10),
    ]
    found = ClassModel(tried, chosen=[(0, 1), (1, 0)])
    assert found.pictures.flatten().tolist() == [1.0, 12.0]
    assert found.probabilities == pytest.approx([0.7, 0.4])
    summary = found.summary()
    assert summary["probabilities"] == summary["highest"] == pytest.approx([0.7, 0.4])
    assert summary["roughness"] == [1.0, 1.0]
    assert (summary["starts"], summary["num_settings"]) == (2, 2)
    assert summary["starts_above_half"] == [2, 0]  # of four attempts: 0.7 and 0.6; none
    assert [row["chosen"] for row in summary["tried"]] == [[0], [1]]
    assert summary["tried"][0]["probabilities"] == pytest.approx([0.7, 0.3])
    assert summary["tried"][1]["roughness"] == [1.0, 1.0]
    assert summary["tried"][1]["each_start"] == [
        pytest.approx([0.6, 0.1]),
        pytest.approx([0.4, 0.2]),
    ]


def test_best_start_is_the_most_probable_then_the_smoothest():
    def best(probabilities, roughness):
        return best_start(torch.tensor(probabilities), torch.tensor(roughness))

    assert best([0.5, 0.8, 0.7], [0.1, 9.0, 0.1]) == 1
    assert best([0.995, 0.999, 0.98], [2.0, 3.0, 1.0]) == 0  # within a hundredth: the smoother
    assert best([0.3, 0.3], [2.0, 1.0]) == 1


def test_a_search_that_fails_for_one_action_says_so():
    """Action 1 can't win: its logit is far below. Its picture is still the best there is."""
    network = MLP((1, 6, 12), 3, hidden=())
    with torch.no_grad():
        network.layers.logits.bias.copy_(torch.tensor([0.0, -20.0, 0.0]))
    summary = search(network, STATISTICS).summary()
    assert summary["highest"][1] < 0.01 and summary["starts_above_half"][1] == 0
    assert summary["highest"][0] > 0.5 and summary["starts_above_half"][0] > 0


def test_one_start_that_succeeds_is_not_drowned_by_those_that_fail():
    """The mean of a picture and of its opposite is flat; the best of them is not."""
    found = made([[0.9, 0.0], [0.0, 0.9]], [[1.0, 1.0], [1.0, 1.0]], 0)
    chosen = [
        (0, best_start(*pair)) for pair in zip(found.probabilities, found.roughness, strict=True)
    ]
    assert chosen == [(0, 0), (0, 1)]


def test_a_search_notes_everything_it_tried(halves):
    found = search(halves, STATISTICS, seed=4)
    summary = found.summary()
    assert len(summary["tried"]) == summary["num_settings"] == 6 and summary["starts"] == 8
    assert {(r["parameterisation"], r["blur"]) for r in summary["tried"]} == {
        (p, b) for p in ("pixel", "fourier") for b in (0.5, 0.9, 1.4)
    }
    assert sorted(a for row in summary["tried"] for a in row["chosen"]) == [0, 1, 2]
    for action in range(3):
        every = [p for row in summary["tried"] for p in row["each_start"][action]]
        assert summary["highest"][action] == max(every)
        assert summary["starts_above_half"][action] == sum(p > 0.5 for p in every)
        assert max(every) - 0.01 <= summary["probabilities"][action] <= max(every)
        row = next(row for row in summary["tried"] if action in row["chosen"])
        assert row["probabilities"][action] == summary["probabilities"][action]
        assert row["roughness"][action] == summary["roughness"][action]
    reached = halves(found.pictures).softmax(-1).diagonal().tolist()
    assert reached == pytest.approx(summary["probabilities"], abs=1e-5)
    again = visualise(halves, STATISTICS, found.tried[0].settings, seed=4)
    assert torch.equal(again.pictures, found.tried[0].pictures)


def test_roughness_is_that_of_neighbours_over_the_data_sets():
    """Columns 0 1 0 1: neighbours across differ by 1, those down by 0; the data set's by 2."""
    stripes = torch.tensor([0.0, 1.0]).repeat(3).expand(1, 1, 4, 6)
    statistics = PictureStatistics.of(2 * stripes)
    assert statistics == PictureStatistics(
        mean=1.0, std=pytest.approx((24 / 23) ** 0.5), low=0.0, high=2.0, roughness=2.0
    )
    rows = stripes.mT.contiguous()
    assert PictureStatistics.of(rows).roughness == 1.0
    assert PictureStatistics.of(torch.cat([stripes, 0 * stripes])).roughness == 0.5


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
