"""Sets of actions: mirror images, opposites, distances, probabilities."""

import numpy as np
import pytest
import torch

from drone_rl.sim.actions import MOVE_SETS, MOVES, MOVES_3D, DiscreteActions
from tests.five_actions import FIVE


def test_constant_and_random_actions():
    assert (MOVES.always("right"), FIVE.always("stay")) == (2, 4)
    drawn = FIVE.sample((5000,), torch.Generator().manual_seed(0))
    assert (drawn.bincount() / 5000 - 0.2).abs().max() < 0.03
    assert FIVE.sample((2, 3), torch.Generator()).shape == (2, 3)


def test_greedy_action_has_the_greatest_output():
    outputs = torch.tensor([[0.0, 3.0, 1.0], [2.0, 0.0, 1.0]])
    assert MOVES.greedy(outputs).tolist() == [1, 0]
    assert torch.equal(MOVES.scores(outputs), outputs)


def test_probabilities_are_the_softmax_of_outputs():
    outputs = torch.tensor([[0.0, 0.0, 0.0, 0.0, 4.0**0.5], [1.0, 2.0, 0.0, 0.0, 0.0]])
    probs = FIVE.probabilities(outputs)
    torch.testing.assert_close(probs.sum(-1), torch.ones(2))
    assert probs[0, 4] / probs[0, 0] == pytest.approx(np.exp(2.0))
    assert FIVE.chosen(probs).tolist() == [4, 1]


@pytest.mark.parametrize("kind", [torch.tensor, np.array])
def test_mirror_swaps_only_left_and_right(kind):
    probs = kind([[0.1, 0.2, 0.3, 0.4, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]])
    assert FIVE.mirror(probs).tolist() == [
        probs[0, [0, 1, 3, 2, 4]].tolist(),
        [0, 0, 0, 1, 0],
    ]
    assert FIVE.mirror(FIVE.mirror(probs)).tolist() == probs.tolist()
    assert FIVE.prob_left(probs).tolist() == [probs[0, 2], 1.0]


@pytest.mark.parametrize("kind", [torch.tensor, np.array])
def test_distance_is_the_total_variation(kind):
    probs = kind([[0.5, 0.5, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0]])
    other = kind([[0.25, 0.5, 0.25, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0]])
    assert FIVE.distance(probs, other).tolist() == [0.25, 1.0]
    assert FIVE.distance(probs, probs).tolist() == [0.0, 0.0]
    assert FIVE.distance(probs[None], other[None]).tolist() == [[0.25, 1.0]]


@pytest.mark.parametrize(
    ("probs", "other", "expected"),
    [
        ((0, 0, 1, 0, 0), (0, 0, 0, 1, 0), 1.0),  # left with certainty, right with certainty
        ((0, 0, 0, 1, 0), (0, 0, 1, 0, 0), -1.0),  # reversed
        ((0, 0, 0.6, 0.4, 0), (0, 0, 0.5, 0.5, 0), 0.1),
        ((0, 0, 0.6, 0.1, 0.3), (0, 0, 0.4, 0.6, 0), 0.2),  # the lesser of 0.2 and 0.5
        ((0, 0, 0.6, 0.3, 0.1), (1, 0, 0, 0, 0), 0.0),  # both rise: no opposition
        ((1, 0, 0, 0, 0), (0, 1, 0, 0, 0), 0.0),  # up and down are not sides
    ],
)
def test_opposition_is_the_smaller_change_of_left_and_right(probs, other, expected):
    assert FIVE.opposition(np.array(probs), np.array(other)) == pytest.approx(expected)


FULL = MOVE_SETS["moves_full"]


def test_sets_of_moves_extend_the_chapters():
    assert MOVES_3D.names == (*MOVES.names, "up", "down") == FULL.names[:5]
    assert MOVE_SETS["moves_turning"].names == ("forward", "turn left", "turn right")
    assert FULL.names[5:] == ("back", "turn left", "turn right")
    assert [MOVES_3D.names[i] for i in MOVES_3D.order] == ["left", "up", "forward", "down", "right"]
    assert [MOVES.names[i] for i in MOVES.opposite] == ["forward", "right", "left"]
    assert all(len(actions.shown.names) == len(actions) for actions in MOVE_SETS.values())


def test_full_moves_have_mirror_images_and_opposites():
    names = FULL.names
    assert [names[i] for i in FULL.mirrored] == [
        *("forward", "right", "left", "up", "down", "back", "turn right", "turn left")
    ]
    assert [names[i] for i in FULL.opposite] == [
        *("back", "right", "left", "down", "up", "forward", "turn right", "turn left")
    ]
    assert [names[i] for i in FULL.lefts] == ["left", "turn left"] and FULL.left == 1
    turning = MOVE_SETS["moves_turning"]
    assert (turning.left, turning.right, turning.lefts) == (1, 2, (1,))
    assert FULL.speeds_of(torch.tensor([5, 6, 4])).tolist() == [
        [-1, 0, 0, 0],
        [0, 0, 0, 1],
        [0, 0, -1, 0],
    ]


FOUR = DiscreteActions(
    names=("left", "right", "far left", "far right"),
    mirrored=(1, 0, 3, 2),
    opposite=(1, 0, 3, 2),
    left=0,
    order=(2, 0, 1, 3),
    arrows=((-1, 0), (1, 0), (-1, 0), (1, 0)),
    colors=((0, 0, 0),) * 4,
)


class Both(DiscreteActions):
    lefts = (0, 2)


def test_opposition_sums_all_parts_that_lead_left():
    both = Both(**vars(FOUR))
    for kind in (torch.tensor, np.array):
        probs = kind([[0.5, 0.0, 0.25, 0.25]])
        assert (FOUR.prob_left(probs).tolist(), both.prob_left(probs).tolist()) == (
            [0.5],
            [0.75],
        )
    one, other = np.array([0.5, 0.0, 0.25, 0.25]), np.array([0.0, 0.25, 0.25, 0.5])
    assert FOUR.opposition(one, other) == 0.25  # 0.5 and 0.25
    assert both.opposition(one, other) == 0.5  # 0.5 and 0.5


def test_agrees_is_true_for_equal_parts_or_sides():
    both, every = Both(**vars(FOUR)), torch.arange(4)
    assert FOUR.agrees(every, torch.tensor(0)).tolist() == [True, False, False, False]
    assert both.agrees(every, torch.tensor(0)).tolist() == [True, False, True, False]
    assert FOUR.agrees(every, every).all()


def test_undoing_and_turning_parts():
    every = torch.arange(4)
    assert FOUR.undoes(every, torch.tensor([1, 1, 3, 2])).tolist() == [True, False, True, True]
    assert FOUR.can_be_undone(every).all() and FOUR.turns(every).all()
    still = DiscreteActions(**{**vars(FOUR), "opposite": (0, 1, 2, 3), "mirrored": (1, 0, 2, 3)})
    assert not still.can_be_undone(every).any() and not still.undoes(every, every).any()
    assert still.turns(every).tolist() == [True, True, False, False]
