import pytest
import torch

from benchmarks.known_map_policies import (
    WINDOWS,
    _span,
    convolution,
    detector,
    hidden_layer,
    linear,
    make_policies,
    path_weights,
    trained,
)
from drone_rl.explanations.hooks import probabilities
from drone_rl.policies import MLP, SmallCNN

SIZE = (25, 64)


@pytest.fixture(scope="module")
def images():
    generator = torch.Generator().manual_seed(0)
    absent = torch.full((1, *SIZE), 0.5)
    absent[:, 12:] = -0.3
    x = absent + 0.7 * torch.randn(60, 1, *SIZE, generator=generator)
    seen = x[:, 0, 8:18, 4:20].mean((1, 2))
    wanted = (seen > seen.median()).long()
    return absent, x, wanted


@pytest.fixture(scope="module")
def policies(images):
    return make_policies(*images)


def test_path_weights_of_a_linear_policy_by_hand():
    network = MLP((1, 1, 3), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.copy_(torch.tensor([[1.0, 5.0, 0.0], [-3.0, 5.0, 0.0]]))
    # subtracting the mean leaves weights 2 and -2, 0, 0
    found = path_weights(network, torch.zeros(2, 1, 1, 3), torch.tensor([0, 1]))
    assert found.tolist() == [[[4.0, 0.0, 0.0]]] * 2
    assert network.layers.logits.weight[1, 0] == -3.0


def test_path_weights_sum_over_paths():
    network = MLP((1, 1, 2), 2, hidden=(2,))
    with torch.no_grad():
        network.layers.fc1.weight.copy_(torch.tensor([[1.0, -2.0], [-3.0, 0.0]]))
        network.layers.fc1.bias.fill_(-100.0)
        network.layers.logits.weight.copy_(torch.tensor([[1.0, 0.5], [-1.0, -0.5]]))
    # pixel 0: 2 (1) + 1 (3), pixel 1: 2 (2)
    assert path_weights(network, torch.zeros(1, 1, 1, 2), torch.zeros(1)).tolist() == [[[5.0, 4.0]]]


def test_there_are_enough_policies_of_both_architectures_with_unique_names(policies):
    seeing = [p for p in policies if not p.is_blind]
    assert len(seeing) >= 24 and len(policies) - len(seeing) >= 3
    assert len({p.name for p in policies}) == len(policies)
    assert {type(p.network) for p in policies} == {MLP, SmallCNN}


def test_a_policy_depends_only_on_pixels_with_nonzero_path_weights(policies, images):
    _, x, _ = images
    for p in policies:
        seen = path_weights(p.network, x[:1], torch.zeros(1))[0] > 0
        before, other = probabilities(p.network, x), x + torch.randn_like(x)
        outside = probabilities(p.network, torch.where(seen, x, other))
        inside = probabilities(p.network, torch.where(seen, other, x))
        assert torch.allclose(before, outside, atol=1e-6), p.name
        moved = 0.5 * (before - inside).abs().sum(-1).max()
        assert (moved < 1e-6) if p.is_blind else (moved > 1e-3), p.name
        if not p.is_blind:
            assert 0 < seen.float().mean() < 0.6, p.name


def test_a_linear_policy_depends_on_its_window(images):
    network = linear(images[0], [WINDOWS["left"]], 1.0)
    seen = path_weights(network, images[1][:1], torch.zeros(1))[0] > 0
    assert seen.nonzero().amin(0).tolist() == [8, 4] and seen.nonzero().amax(0).tolist() == [17, 19]
    bright = images[0].clone()
    bright[:, 8:18, 4:20] += 3.0
    assert network(bright[None]).argmax() == 1 and network(-bright[None]).argmax() == 2
    assert network(images[0][None]).abs().max() < 1e-5


def test_a_trained_policy_has_weights_in_its_window_only(images):
    _, x, wanted = images
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
def test_windows_in_pixels(name, rows, columns):
    found = _span(WINDOWS[name], *SIZE)
    assert [(part.start, part.stop) for part in found] == [rows, columns]


def test_a_window_has_at_least_one_pixel():
    assert _span((0.5, 0.5, 0.9, 0.9), 4, 10) == (slice(2, 3), slice(9, 10))


@pytest.mark.parametrize("make", [linear, hidden_layer, convolution])
def test_logits_are_zero_in_the_empty_scene_and_prefer_left_if_it_is_brighter(make):
    absent = torch.linspace(-1.0, 1.0, 24 * 64).view(1, 24, 64)
    network = make(absent, [WINDOWS["left"], WINDOWS["ground"]], 2.0)
    assert network(absent[None]).abs().max() < 1e-5
    brighter, darker = network(absent[None] + 0.5)[0], network(absent[None] - 0.5)[0]
    assert brighter[1] > 0.1 and darker[2] > 0.1
    torch.testing.assert_close(brighter[1], -brighter[2])
    assert brighter[0] == darker[0] == 0


def test_a_detector_by_hand():
    """The image is darker than the empty scene by 1.5; the threshold is 0.2, the scale 6."""
    network = detector(torch.full((1, 24, 64), 0.5), WINDOWS["left"])
    image = torch.full((1, 1, 24, 64), 0.5)
    assert network(image).abs().max() == 0
    assert network(image - 1.5)[0].tolist() == pytest.approx([0.0, 7.8, -7.8], abs=1e-4)


def test_names_of_policies(policies):
    names = [p.name for p in policies]
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
    assert [p.name for p in policies if p.is_blind] == [
        "blind: constant", "blind: too sure", "blind: dead units",
    ]  # fmt: skip
