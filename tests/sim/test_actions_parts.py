import numpy as np
import pytest
import torch

from drone_rl.sim.actions import DiscreteActions

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


def test_mirrored_must_be_an_involution():
    with pytest.raises(ValueError, match="mirrored"):
        DiscreteActions(**{**vars(FOUR), "mirrored": (1, 2, 3, 0)})


def test_names_and_indices_of_a_set():
    assert (len(FOUR), FOUR.left, FOUR.right, FOUR.lefts) == (4, 0, 1, (0,))
    rows = torch.tensor([[0.1, 0.2, 0.6, 0.1], [0.4, 0.3, 0.2, 0.1], [0.0, 0.1, 0.2, 0.7]])
    assert FOUR.chosen(rows).tolist() == [2, 0, 3]
    mirrored = torch.tensor([0.2, 0.1, 0.1, 0.6])
    assert torch.equal(FOUR.mirror(rows[0]), mirrored)


def test_distance_is_half_the_sum_of_absolute_differences():
    one, other = [0.5, 0.25, 0.25, 0.0], [0.0, 0.25, 0.25, 0.5]
    for kind in (torch.tensor, np.array):
        assert float(FOUR.distance(kind(one), kind(other))) == 0.5
        assert float(FOUR.distance(kind(one), kind(one))) == 0.0
        assert float(FOUR.distance(kind([1.0, 0, 0, 0]), kind([0, 0, 1.0, 0]))) == 1.0


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("arrows", FOUR.arrows[:3], "give an arrow and a color to each of 4"),
        ("colors", FOUR.colors[:3], "give an arrow and a color to each of 4"),
        ("order", (0, 1, 2, 2), "must name every action once"),
        ("opposite", (0, 1, 2, 2), "opposite"),
    ],
)
def test_inconsistent_sets_raise(field, value, message):
    with pytest.raises(ValueError, match=message):
        DiscreteActions(**{**vars(FOUR), field: value})


@pytest.mark.parametrize("count", [3, 5])
def test_arrows_and_colors_must_match_the_parts(count):
    with pytest.raises(ValueError, match="give an arrow"):
        DiscreteActions(
            **{**vars(FOUR), "arrows": ((0, 0),) * count, "colors": ((0, 0, 0),) * count}
        )


def test_undoing_and_turning_parts():
    every = torch.arange(4)
    assert FOUR.undoes(every, torch.tensor([1, 1, 3, 2])).tolist() == [True, False, True, True]
    assert FOUR.can_be_undone(every).all() and FOUR.turns(every).all()
    still = DiscreteActions(**{**vars(FOUR), "opposite": (0, 1, 2, 3), "mirrored": (1, 0, 2, 3)})
    assert not still.can_be_undone(every).any() and not still.undoes(every, every).any()
    assert still.turns(every).tolist() == [True, True, False, False]
