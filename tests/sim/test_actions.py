import numpy as np
import pytest
import torch

from drone_rl.sim.actions import MOVES, DiscreteActions, Move
from tests.five_actions import FIVE


def test_move_numbers_are_those_of_files():
    assert [(move.name, move.value) for move in Move] == [("FORWARD", 0), ("LEFT", 1), ("RIGHT", 2)]
    assert MOVES.names == ("forward", "left", "right")
    assert (MOVES.left, MOVES.right, MOVES.order) == (1, 2, (1, 0, 2))
    assert (len(MOVES), len(FIVE), FIVE.right) == (3, 5, 3)
    assert MOVES.entry == ((), torch.int64, 0, 2)
    assert MOVES.output_names == MOVES.names and (MOVES.num_outputs, FIVE.num_outputs) == (3, 5)


def test_constant_and_random_actions():
    assert (MOVES.always("right"), FIVE.always("stay")) == (2, 4)
    drawn = FIVE.sample((5000,), torch.Generator().manual_seed(0))
    assert (drawn.bincount() / 5000 - 0.2).abs().max() < 0.03
    assert FIVE.sample((2, 3), torch.Generator()).shape == (2, 3)


def test_greedy_action_has_the_greatest_output():
    outputs = torch.tensor([[0.0, 3.0, 1.0], [2.0, 0.0, 1.0]])
    assert MOVES.greedy(outputs).tolist() == [1, 0]
    assert torch.equal(MOVES.scores(outputs), outputs)


def test_recorded_actions_are_indices():
    action = torch.tensor([0, 4, 2])
    assert FIVE.part(action) is action and FIVE.kept(action) == {"actions": action}
    assert FIVE.fields() == {"actions": "action taken: 0 up, 1 down, 2 left, 3 right, 4 stay"}
    assert FIVE.is_reversible(FIVE.kept(action)).tolist() == [True, False, True]


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


def test_opposite_actions_undo_each_other():
    action = torch.tensor([1, 0, 3, 2, 4, 2, 0])
    before = torch.tensor([0, 1, 2, 3, 4, 2, 2])
    assert FIVE.undoes(action, before).tolist() == [True] * 4 + [False] * 3
    assert FIVE.can_be_undone(torch.arange(5)).tolist() == [True] * 4 + [False]
    assert MOVES.can_be_undone(torch.arange(3)).tolist() == [False, True, True]


def test_as_dict_returns_plain_values():
    assert MOVES.as_dict() == {
        "names": ["forward", "left", "right"],
        "order": [1, 0, 2],
        "arrows": [[0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]],
        "mirrored": [0, 2, 1],
        "left": 1,
        "colors": [[204, 121, 167], [230, 159, 0], [0, 114, 178]],
    }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mirrored": (1, 2, 0)}, "mirrored"),
        ({"mirrored": (0, 0, 0)}, "mirrored"),
        ({"mirrored": (0, 1, 3)}, "mirrored"),
        ({"opposite": (1, 2, 0)}, "opposite"),
        ({"order": (0, 1, 1)}, "order"),
        ({"colors": ((0, 0, 0),)}, "color"),
        ({"left": 0}, "left"),
    ],
)
def test_inconsistent_sets_raise(change, message):
    given = {name: getattr(MOVES, name) for name in MOVES.__dataclass_fields__}
    with pytest.raises(ValueError, match=message):
        DiscreteActions(**{**given, **change})


def test_moves_in_three_dimensions_extend_the_chapters():
    from drone_rl.sim.actions import DIRECTIONS_3D, MOVES, MOVES_3D

    assert MOVES_3D.names == (*MOVES.names, "up", "down")
    assert [MOVES_3D.names[i] for i in MOVES_3D.opposite[3:]] == ["down", "up"]
    assert [sum(d) for d in DIRECTIONS_3D] == [1, 1, -1, 1, -1]
