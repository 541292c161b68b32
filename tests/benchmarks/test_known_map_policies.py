import pytest
import torch

from benchmarks.known_map_policies import (
    WINDOWS,
    _span,
    convolution,
    detector,
    linear,
    plant,
    reach,
    trained,
    two_looks,
)
from drone_rl.explanations.hooks import probabilities
from drone_rl.policies import MLP, SmallCNN

SIZE = (25, 64)


@pytest.fixture(scope="module")
def pictures():
    generator = torch.Generator().manual_seed(0)
    absent = torch.full((1, *SIZE), 0.5)
    absent[:, 12:] = -0.3
    x = absent + 0.7 * torch.randn(60, 1, *SIZE, generator=generator)
    seen = x[:, 0, 8:18, 4:20].mean((1, 2))
    wanted = (seen > seen.median()).long()
    return absent, x, wanted


@pytest.fixture(scope="module")
def planted(pictures):
    return plant(*pictures)


def test_reach_of_a_linear_policy_by_hand():
    network = MLP((1, 1, 3), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.copy_(torch.tensor([[1.0, 5.0, 0.0], [-3.0, 5.0, 0.0]]))
    # what raises both logits alike chooses nothing; else the sizes of 2 and -2
    found = reach(network, torch.zeros(2, 1, 1, 3), torch.tensor([0, 1]))
    assert found.tolist() == [[[4.0, 0.0, 0.0]]] * 2
    assert network.layers.logits.weight[1, 0] == -3.0


def test_reach_sums_over_paths():
    network = MLP((1, 1, 2), 2, hidden=(2,))
    with torch.no_grad():
        network.layers.fc1.weight.copy_(torch.tensor([[1.0, -2.0], [-3.0, 0.0]]))
        network.layers.fc1.bias.fill_(-100.0)
        network.layers.logits.weight.copy_(torch.tensor([[1.0, 0.5], [-1.0, -0.5]]))
    # pixel 0: 2 (1) + 1 (3), pixel 1: 2 (2)
    assert reach(network, torch.zeros(1, 1, 1, 2), torch.zeros(1)).tolist() == [[[5.0, 4.0]]]


def test_at_least_two_dozen_look_somewhere_and_no_two_alike(planted):
    looking = [p for p in planted if not p.is_blind]
    assert len(looking) >= 24 and len(planted) - len(looking) >= 3
    assert len({p.name for p in planted}) == len(planted)
    assert {type(p.network) for p in planted} == {MLP, SmallCNN}


def test_nothing_outside_its_reach_moves_a_policy_and_something_inside_does(planted, pictures):
    _, x, _ = pictures
    for p in planted:
        seen = reach(p.network, x[:1], torch.zeros(1))[0] > 0
        before, other = probabilities(p.network, x), x + torch.randn_like(x)
        outside = probabilities(p.network, torch.where(seen, x, other))
        inside = probabilities(p.network, torch.where(seen, other, x))
        assert torch.allclose(before, outside, atol=1e-6), p.name
        moved = 0.5 * (before - inside).abs().sum(-1).max()
        assert (moved < 1e-6) if p.is_blind else (moved > 1e-3), p.name
        if not p.is_blind:
            assert 0 < seen.float().mean() < 0.6, p.name


def test_windows_are_where_they_are_said_to_be(pictures):
    network = linear(pictures[0], [WINDOWS["left"]], 1.0)
    seen = reach(network, pictures[1][:1], torch.zeros(1))[0] > 0
    assert seen.nonzero().amin(0).tolist() == [8, 4] and seen.nonzero().amax(0).tolist() == [17, 19]
    bright = pictures[0].clone()
    bright[:, 8:18, 4:20] += 3.0
    assert network(bright[None]).argmax() == 1 and network(-bright[None]).argmax() == 2
    assert network(pictures[0][None]).abs().max() < 1e-5


def test_what_is_trained_learns_in_its_window_alone(pictures):
    _, x, wanted = pictures
    sees, hidden = (trained(WINDOWS[name], x, wanted) for name in ("left", "sky, left"))
    assert (sees(x).argmax(-1) == wanted).float().mean() > 0.8
    weight = hidden.layers.fc1.weight.view(16, *SIZE)
    assert weight[:, 8:].abs().max() == 0 and weight[:, :8, :24].abs().min(0).values.max() > 0


@pytest.mark.parametrize(
    ("name", "rows", "columns"),
    [
        ("left", (8, 18), (4, 20)),
        ("right", (8, 18), (44, 60)),
        ("middle", (10, 16), (28, 36)),
        ("sky, left", (0, 8), (0, 24)),
        ("ground, right", (18, 25), (40, 64)),
        ("ground", (20, 25), (0, 64)),
        ("left edge", (0, 25), (0, 8)),
        ("small", (10, 15), (12, 19)),
    ],
)
def test_windows_by_the_pixel(name, rows, columns):
    found = _span(WINDOWS[name], *SIZE)
    assert [(part.start, part.stop) for part in found] == [rows, columns]


def test_a_window_has_a_pixel_at_least():
    assert _span((0.5, 0.5, 0.9, 0.9), 4, 10) == (slice(2, 3), slice(9, 10))


@pytest.mark.parametrize("make", [linear, two_looks, convolution])
def test_nothing_is_chosen_in_the_empty_scene_and_left_where_it_is_brighter(make):
    absent = torch.linspace(-1.0, 1.0, 24 * 64).view(1, 24, 64)
    network = make(absent, [WINDOWS["left"], WINDOWS["ground"]], 2.0)
    assert network(absent[None]).abs().max() < 1e-5
    brighter, darker = network(absent[None] + 0.5)[0], network(absent[None] - 0.5)[0]
    assert brighter[1] > 0.1 and darker[2] > 0.1
    torch.testing.assert_close(brighter[1], -brighter[2])
    assert brighter[0] == darker[0] == 0


def test_a_detector_by_hand():
    """Darker by 1.5 than the empty scene, of which 0.2 do not count: six times 1.3."""
    network = detector(torch.full((1, 24, 64), 0.5), WINDOWS["left"])
    picture = torch.full((1, 1, 24, 64), 0.5)
    assert network(picture).abs().max() == 0
    assert network(picture - 1.5)[0].tolist() == pytest.approx([0.0, 7.8, -7.8], abs=1e-4)


def test_what_is_planted_by_name(planted):
    names = [p.name for p in planted]
    assert len(names) == 2 * len(WINDOWS) + 4 + 3 + 4 + 3
    assert names[16:20] == [
        "left and ground, right",
        "right and sky, left",
        "ground and middle",
        "left edge and right",
    ]
    trained_ones = [name for name in names if name.endswith("trained")]
    assert [n.removesuffix(", trained") for n in trained_ones] == [
        "left", "right", "left edge", "ground, right",
    ]  # fmt: skip
    assert [p.name for p in planted if p.is_blind] == [
        "blind: constant", "blind: too sure", "blind: dead units",
    ]  # fmt: skip
