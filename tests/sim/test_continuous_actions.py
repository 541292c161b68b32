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
