import dataclasses

import pytest
import torch

from drone_rl.explanations.class_models import (
    Attempts,
    ClassModel,
    ClassModelSettings,
    ImageStatistics,
    _Ascent,
    gaussian_blur,
    search,
    visualise,
)
from drone_rl.policies import MLP

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
def test_pictures_show_what_the_policy_waits_for(halves, parameterisation, objective):
    settings = ClassModelSettings(
        maximize=objective, parameterisation=parameterisation, blur=0.5, steps=64, starts=2
    )
    found = visualise(halves, STATISTICS, settings, seed=3)
    left, right = found.images[1, :, 0], found.images[2, :, 0]
    assert (left[..., :6].mean((1, 2)) < left[..., 6:].mean((1, 2)) - 0.5).all()
    assert (right[..., 6:].mean((1, 2)) < right[..., :6].mean((1, 2)) - 0.5).all()
    assert (found.probabilities[1:] > 0.99).all()
    for action in range(3):
        reached = halves(found.images[action]).softmax(-1)[:, action]
        torch.testing.assert_close(found.probabilities[action], reached.detach())


def test_the_same_seed_gives_the_same_picture_and_the_policy_is_left_alone(halves):
    before = {k: v.clone() for k, v in halves.state_dict().items()}
    settings = ClassModelSettings(steps=5, starts=2)
    images = [visualise(halves, STATISTICS, settings, seed=s).images for s in (1, 1, 2)]
    assert torch.equal(images[0], images[1]) and not torch.equal(images[0], images[2])
    assert all(torch.equal(before[k], v) for k, v in halves.state_dict().items())
    assert all(p.grad is None for p in halves.parameters())


def test_pictures_keep_to_the_range_of_real_ones(halves):
    found = visualise(halves, STATISTICS, ClassModelSettings(steps=20, starts=2))
    assert found.images.min() >= STATISTICS.low and found.images.max() <= STATISTICS.high


def made(probabilities, roughness, value):
    """What a setting made of two starts, for two actions; the images' pixels number them."""
    images = value + torch.arange(4.0).view(2, 2, 1, 1, 1)
    settings = ClassModelSettings(starts=2)
    return Attempts(images, torch.tensor(probabilities), torch.tensor(roughness), settings)


def test_picture_is_the_best_starts_never_an_average():
    tried = [
        made([[0.2, 0.7], [0.1, 0.3]], [[0.1, 1.0], [1.0, 1.0]], 0),
        made([[0.6, 0.1], [0.4, 0.2]], [[1.0, 1.0], [1.0, 2.0]], 10),
    ]
    found = ClassModel(tried)
    assert found.images.flatten().tolist() == [1.0, 12.0]
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
    probabilities = torch.tensor([[0.5, 0.8, 0.7], [0.995, 0.999, 0.98], [0.3, 0.3, 0.1]])
    roughness = torch.tensor([[0.1, 9.0, 0.1], [2.0, 3.0, 1.0], [2.0, 1.0, 0.5]])
    found = Attempts(torch.zeros(3, 3, 1, 1, 1), probabilities, roughness, ClassModelSettings())
    assert found.best() == [1, 0, 1]  # within a hundredth: the smoother


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
    assert found.best() == [0, 1]


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
    reached = halves(found.images).softmax(-1).diagonal().tolist()
    assert reached == pytest.approx(summary["probabilities"], abs=1e-5)
    again = visualise(halves, STATISTICS, found.tried[0].settings, seed=4)
    assert torch.equal(again.images, found.tried[0].images)


def test_roughness_is_that_of_neighbours_over_the_data_sets():
    """Columns 0 1 0 1: neighbours across differ by 1, those down by 0; the data set's by 2."""
    stripes = torch.tensor([0.0, 1.0]).repeat(3).expand(1, 1, 4, 6)
    statistics = ImageStatistics.of(2 * stripes)
    assert statistics == ImageStatistics(
        mean=1.0, std=pytest.approx((24 / 23) ** 0.5), low=0.0, high=2.0, roughness=2.0
    )
    rows = stripes.mT.contiguous()
    assert ImageStatistics.of(rows).roughness == 1.0
    assert ImageStatistics.of(torch.cat([stripes, 0 * stripes])).roughness == 0.5


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
    twice = ClassModelSettings(steps=2, lr=5.0, jitter=0)
    found = _Ascent(halves, torch.tensor([1]), WIDE, twice, torch.Generator()).pixels(start)
    torch.testing.assert_close(found[0, 0], expected / 2)


def test_fourier_starts_from_faint_noise_around_the_mean(unrefined):
    start = torch.rand(2, 1, 6, 12, generator=torch.Generator().manual_seed(0))
    still = dataclasses.replace(PLAIN, lr=1e-12)
    network = constant(0.0, 0.0, 0.0)
    ascent = _Ascent(network, torch.tensor([0, 1]), WIDE, still, torch.Generator())
    found = ascent.fourier(start)
    torch.testing.assert_close(found, WIDE.mean + 0.1 * (start - start.mean()))


def test_a_step_on_fourier_coefficients_is_longer_where_the_frequency_is_low(unrefined):
    """Adam moves each part by the rate over 400; the picture's by as much over the frequency."""
    network = MLP((1, 8, 12), 3, hidden=(), generator=torch.Generator().manual_seed(0))
    start = torch.rand(1, 1, 8, 12, generator=torch.Generator().manual_seed(0))
    moved, still = (
        _Ascent(network, torch.tensor([1]), WIDE, dataclasses.replace(PLAIN, lr=lr), None).fourier(
            start
        )
        for lr in (4.0, 1e-12)
    )
    difference = torch.fft.rfft2(moved - still)[0, 0]
    rows, columns = torch.fft.fftfreq(8)[:, None], torch.fft.rfftfreq(12)[None]
    frequency = (rows**2 + columns**2).sqrt()
    steps = (difference * frequency)[1:4, 1:6]  # coefficients that nothing ties to others
    torch.testing.assert_close(steps.real.abs(), torch.full((3, 5), 0.01), rtol=0.02, atol=0)
    torch.testing.assert_close(steps.imag.abs(), torch.full((3, 5), 0.01), rtol=0.02, atol=0)
    assert abs(float(difference[0, 0].real)) == pytest.approx(
        0.01 * 12, rel=0.02
    )  # 1 / 12 at least


def refine(images, statistics):
    return _Ascent(None, None, statistics, ClassModelSettings(blur=0.7), None).refine(images)


def test_refined_images_have_the_data_sets_mean_deviation_and_range():
    images = torch.randn(3, 1, 6, 12, generator=torch.Generator().manual_seed(0)) * 4 + 9
    refined = refine(images, WIDE)
    torch.testing.assert_close(refined.mean((1, 2, 3)), torch.full((3,), 0.3))
    torch.testing.assert_close(refined.std((1, 2, 3)), torch.full((3,), 2.0))
    narrow = dataclasses.replace(WIDE, low=-1.0, high=0.5)
    assert refine(images, narrow).unique()[[0, -1]].tolist() == [-1.0, 0.5]
    blurred = gaussian_blur(images, 0.7)
    deviation = (blurred - blurred.mean((1, 2, 3), keepdim=True)) / blurred[0].std()
    torch.testing.assert_close(refined[0], 0.3 + 2 * deviation[0])


def test_jitter_shifts_by_up_to_its_reach_with_edges_repeated():
    images = torch.arange(30.0).view(1, 1, 5, 6)
    rows, columns = torch.arange(5), torch.arange(6)
    shifts = {
        (down, across): images[..., (rows + down).clamp(0, 4), :][
            ..., (columns + across).clamp(0, 5)
        ]
        for down in (-1, 0, 1)
        for across in (-1, 0, 1)
    }
    generator, seen = torch.Generator().manual_seed(0), set()
    for _ in range(80):
        found = _Ascent(None, None, WIDE, ClassModelSettings(jitter=1), generator).jitter(images)
        seen |= {shift for shift, picture in shifts.items() if torch.equal(picture, found)}
    assert seen == set(shifts)


def test_a_blur_keeps_flat_pictures_and_their_mean():
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


def test_starts_are_anywhere_between_the_darkest_and_the_brightest(unrefined):
    statistics = ImageStatistics(mean=3.0, std=1.0, low=1.0, high=5.0, roughness=0.5)
    still = dataclasses.replace(PLAIN, lr=1e-12, starts=8)
    found = visualise(constant(0.0, 0.0, 0.0), statistics, still).images
    assert 1.0 <= found.min() < 1.1 and 4.9 < found.max() <= 5.0
    assert abs(float(found.mean()) - 3.0) < 0.2
    assert torch.equal(found[0], found[1])  # the same for each action


def test_of_pictures_without_any_difference_the_roughness_is_large_and_finite():
    statistics = dataclasses.replace(WIDE, roughness=0.0)
    found = visualise(constant(0.0, 0.0, 0.0), statistics, dataclasses.replace(PLAIN, starts=2))
    assert torch.isfinite(found.roughness).all() and found.roughness.min() > 1e9


def test_a_plain_step_is_the_rate_times_the_gradient(halves, unrefined):
    plain = PLAIN.replace(step="plain", lr=3.0)
    start = torch.zeros(1, 1, 6, 12)
    found = _Ascent(halves, torch.tensor([1]), WIDE, plain, torch.Generator()).pixels(start)
    gradient = torch.zeros(6, 12)
    gradient[:, :6], gradient[:, 6:] = -0.2 + 0.2 / 3, 0.2 / 3
    torch.testing.assert_close(found[0, 0], 3.0 * gradient)


def test_squared_pixels_are_subtracted_from_the_objective():
    images = torch.full((2, 1, 6, 12), 0.5)
    settings = ClassModelSettings(jitter=0, l2=0.1)
    ascent = _Ascent(constant(1.0, 2.0, 3.0), torch.tensor([0, 2]), WIDE, settings, None)
    ascent = dataclasses.replace(ascent, generator=torch.Generator())
    penalty = 0.1 * 72 * 0.25
    assert ascent.value(images).tolist() == pytest.approx([-1 - penalty, 1 - penalty])


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
    statistics = dataclasses.replace(WIDE, low=-1.0, high=2.0)
    settings = ClassModelSettings(**{"blur": 0.0, "clamp": False, **changes})
    found = _Ascent(None, None, statistics, settings, None).refine(images)
    torch.testing.assert_close(found[0, 0], torch.tensor(expected), rtol=1e-5, atol=1e-5)


def test_a_constant_start_is_the_mean_pixel():
    settings = ClassModelSettings(initial="constant", steps=1, lr=1e-9, jitter=0, starts=2)
    settings = settings.replace(normalize="none", blur=0.0, clamp=False)
    found = visualise(constant(0.0, 0.0, 0.0), WIDE, settings)
    torch.testing.assert_close(found.images, torch.full((3, 2, 1, 6, 12), WIDE.mean))
