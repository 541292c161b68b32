"""Continuous actions: rates, parts and their probabilities."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import ActionSettings
from drone_rl.sim.continuous_actions import ContinuousActions, normal_of

SETTINGS = ActionSettings(kind="velocity", forward_speed=4, sideways_speed=3, yaw_rate=45)


ALL = ContinuousActions.of(SETTINGS)


STRAIGHT = ContinuousActions.of(SETTINGS.replace(yaw_rate=0.0))


EDGE = math.atanh(1 / 3)


DEVIATION = math.exp(-0.5)


def outputs(forward=0.0, left=0.0, yaw=0.0):
    """Return outputs with these means, below 3, and deviation exp(-0.5)."""
    means = [3 * math.atanh(mean / 3) for mean in (forward, left, yaw)]
    return torch.tensor([*means, 0.0, 0.0, 0.0], dtype=torch.float64)


FREE = ContinuousActions.of(SETTINGS.replace(climb_speed=2.0, backward_speed=1.0))


def phi(x):
    return 0.5 * math.erfc(-x / math.sqrt(2))


def test_to_rates_converts_to_units():
    action = torch.tensor([[-1.0, 0, 0], [1, 1, 1], [0, -0.5, -1], [9, -9, 9]])
    turn = math.pi / 4
    expected = [[0, 0, 0], [4, 3, turn], [2, -1.5, -turn], [4, -3, turn]]
    assert ALL.to_rates(action).tolist() == expected
    assert ALL.to_rates(action).dtype == torch.float64


def test_zero_outputs_mean_half_speed_ahead():
    mean, deviation = normal_of(torch.zeros(2, 6, dtype=torch.float64))
    assert mean.tolist() == [[0.0] * 3] * 2
    torch.testing.assert_close(deviation, torch.full_like(deviation, DEVIATION))
    most, least = (normal_of(torch.full((2,), end)) for end in (99.0, -99.0))
    assert (most[0].item(), most[1].item()) == pytest.approx((3.0, 1.0))
    assert (least[0].item(), least[1].item()) == pytest.approx((-3.0, math.exp(-3)))


def test_part_probabilities_match_hand_computed_ones():
    left, right = phi((0.5 - EDGE) / DEVIATION), phi((-0.5 - EDGE) / DEVIATION)
    probs = STRAIGHT.probabilities(outputs(left=0.5))
    assert probs.tolist() == pytest.approx([1 - left - right, left, right])
    turn = phi(-EDGE / DEVIATION)  # to either side
    probs = ALL.probabilities(outputs(left=0.5))
    both = [
        (1 - left - right) * (1 - 2 * turn),
        left * (1 - turn),
        right * (1 - turn),
        turn * (1 - (left + right) / 2),
        turn * (1 - (left + right) / 2),
    ]
    assert probs.tolist() == pytest.approx(both) and probs.sum().item() == pytest.approx(1)


def test_part_of_an_action():
    action = torch.tensor(
        [[1, 0, 0], [1, 0.5, 0], [-1, -0.5, 0], [1, 0.5, -0.6], [0, 0.2, 0.9], [1, 0.3, -0.3]]
    )
    assert ALL.part(action).tolist() == [0, 1, 2, 4, 3, 0]
    assert STRAIGHT.part(action).tolist() == [0, 1, 2, 1, 0, 0]  # without turns
    for number, name in enumerate(ALL.names):
        assert ALL.part(ALL.always(name)) == number
    expected = [[4, 0, 0], [0, 3, 0], [0, -3, 0], [0, 0, math.pi / 4], [0, 0, -math.pi / 4]]
    always = torch.stack([ALL.always(name) for name in ALL.names])
    assert ALL.to_rates(always).tolist() == expected


def test_mirrored_probabilities_equal_those_of_mirrored_means():
    there = ALL.probabilities(outputs(0.5, -0.7, 0.2))
    torch.testing.assert_close(ALL.mirror(ALL.probabilities(outputs(0.5, 0.7, -0.2))), there)
    assert ALL.prob_left(there) == there[1] + there[3]
    assert (
        STRAIGHT.prob_left(STRAIGHT.probabilities(outputs()))
        == STRAIGHT.probabilities(outputs())[1]
    )


def test_left_and_turning_right_undo_each_other():
    one, other = np.array([0, 1.0, 0, 0, 0]), np.array([0, 0, 0, 0, 1.0])
    assert ALL.opposition(one, other) == 1.0 and ALL.opposition(other, one) == -1.0
    part, before = torch.tensor([1, 3, 3, 0]), torch.tensor([2, 4, 2, 0])
    assert ALL.undoes(part, before).tolist() == [True, True, False, False]
    assert ALL.turns(torch.arange(5)).tolist() == [False, True, True, True, True]


def test_probabilities_and_scores_have_gradients():
    free = torch.tensor([0.3, -0.2, 0.4, 0.1, -0.5, 0.7], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(ALL.probabilities, free)
    given = torch.tensor([[1.0, 2.0, 3.0, 9.0, 9.0, 9.0], [0.0, -1.0, 4.0, 9.0, 9.0, 9.0]])
    assert ALL.scores(given).tolist() == [[1.0, 2.0, -2.0, 3.0, -3.0], [0.0, -1.0, 1.0, 4.0, -4.0]]
    assert STRAIGHT.scores(given).tolist() == [[1.0, 2.0, -2.0], [0.0, -1.0, 1.0]]


def test_greedy_action_is_the_mean():
    expected = torch.tensor([1.0, -0.5, 0.25], dtype=torch.float64).tanh()
    torch.testing.assert_close(ALL.greedy(outputs(1.0, -0.5, 0.25)), expected)


def test_lateral_motion_without_progress_is_swaying():
    action = torch.tensor([[-1.0, 0.5, 0], [-0.3, 0.5, 0], [-0.4, 0, -0.5], [-1, 0.2, 0.2]])
    assert ALL.is_reversible(ALL.kept(action)).tolist() == [True, False, True, False]


def test_climb_and_backward_have_parts_and_numbers():
    """Forward goes from -1 to 4 m/s, so -0.6 stands still."""
    assert FREE.names == (*ALL.names, "up", "down", "back")
    assert FREE.entry.shape == (4,) and FREE.num_outputs == 8 and ALL.num_outputs == 6
    action = torch.tensor([[-1.0, 0, 0, 0], [-0.6, 0, 0, 1], [1, 1, 0, -0.5], [0, 0, 0, 9]])
    expected = [[-1, 0, 0, 0], [0, 0, 0, 2], [4, 3, 0, -1], [1.5, 0, 0, 2]]
    torch.testing.assert_close(FREE.to_rates(action), torch.tensor(expected).double())
    assert FREE.speeds_of(action)[0].tolist() == [-0.25, 0, 0, 0]
    assert FREE.speeds_of(action)[2].tolist() == [1, 1, -0.5, 0]
    assert [FREE.names[i] for i in FREE.part(action)] == ["back", "up", "left", "up"]
    slow = torch.tensor([[-0.72, 0, 0, 0], [-0.74, 0, 0, 0], [-0.9, 0.5, 0, 0.9]])
    assert [FREE.names[i] for i in FREE.part(slow)] == ["forward", "back", "up"]  # at -1/3 m/s
    for number, name in enumerate(FREE.names):
        assert FREE.part(FREE.always(name)) == number
    standing = torch.stack([FREE.always(name) for name in ("left", "up")])
    assert FREE.to_rates(standing)[:, 0].tolist() == pytest.approx([0.0, 0.0], abs=1e-6)
    only = ContinuousActions.of(SETTINGS.replace(yaw_rate=0.0, backward_speed=4.0))
    assert only.names == ("forward", "left", "right", "back") and only.entry.shape == (3,)


def test_probabilities_of_all_parts_are_the_frequencies_of_samples():
    means, logs = [0.2, 0.5, -0.3, 0.4], [0.0, 0.5, 0.2, -0.4]
    outputs = torch.tensor([*means, *logs], dtype=torch.float64)
    mean, deviation = normal_of(outputs)
    noise = torch.randn(400_000, 4, generator=torch.Generator().manual_seed(0)).double()
    action = (mean + deviation * noise).tanh()
    fractions = FREE.fractions(action)
    belongs = torch.stack(
        [
            *(fractions[:, 1] > 1 / 3, fractions[:, 1] < -1 / 3),
            *(fractions[:, 2] > 1 / 3, fractions[:, 2] < -1 / 3),
            *(fractions[:, 3] > 1 / 3, fractions[:, 3] < -1 / 3),
            fractions[:, 0] < -0.25 / 3,
        ],
        -1,
    ).double()
    count = belongs.sum(-1, keepdim=True)
    counted = torch.cat([(count == 0).double(), belongs / count.clamp(min=1)], -1)
    expected = FREE.probabilities(outputs)
    assert expected.sum().item() == pytest.approx(1.0)
    torch.testing.assert_close(counted.mean(0), expected, atol=0.003, rtol=0)
    assert torch.autograd.gradcheck(FREE.probabilities, outputs.requires_grad_())
