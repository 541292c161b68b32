import numpy as np
import pytest
import torch

from drone_rl.sim.actions import Parts

FOUR = Parts(
    names=("left", "right", "far left", "far right"),
    mirrored=(1, 0, 3, 2),
    opposite=(1, 0, 3, 2),
    left=0,
    order=(2, 0, 1, 3),
    arrows=((-1, 0), (1, 0), (-1, 0), (1, 0)),
    colors=((0, 0, 0),) * 4,
)


class Both(Parts):
    lefts = (0, 2)


def test_what_leads_to_the_left_is_one_part_or_several():
    both = Both(**vars(FOUR))
    for kind in (torch.tensor, np.array):
        wish = kind([[0.5, 0.0, 0.25, 0.25]])
        assert (FOUR.leaning(wish).tolist(), both.leaning(wish).tolist()) == ([0.5], [0.75])
    one, other = np.array([0.5, 0.0, 0.25, 0.25]), np.array([0.0, 0.25, 0.25, 0.5])
    assert FOUR.opposition(one, other) == 0.25  # 0.5 and 0.25
    assert both.opposition(one, other) == 0.5  # 0.5 and 0.5


def test_parts_agree_that_are_the_same_or_lead_to_the_same_side():
    both, every = Both(**vars(FOUR)), torch.arange(4)
    assert FOUR.agrees(every, torch.tensor(0)).tolist() == [True, False, False, False]
    assert both.agrees(every, torch.tensor(0)).tolist() == [True, False, True, False]
    assert FOUR.agrees(every, every).all()


def test_parts_that_are_not_one_anothers_mirror_images_are_refused():
    with pytest.raises(ValueError, match="mirrored"):
        Parts(**{**vars(FOUR), "mirrored": (1, 2, 3, 0)})


def test_names_and_numbers_of_a_set():
    assert (len(FOUR), FOUR.left, FOUR.right, FOUR.lefts) == (4, 0, 1, (0,))
    wishes = torch.tensor([[0.1, 0.2, 0.6, 0.1], [0.4, 0.3, 0.2, 0.1], [0.0, 0.1, 0.2, 0.7]])
    assert FOUR.chosen(wishes).tolist() == [2, 0, 3]
    mirrored = torch.tensor([0.2, 0.1, 0.1, 0.6])
    assert torch.equal(FOUR.mirror(wishes[0]), mirrored)


def test_wishes_differ_by_half_the_sum_of_what_each_part_gains_and_loses():
    one, other = [0.5, 0.25, 0.25, 0.0], [0.0, 0.25, 0.25, 0.5]
    for kind in (torch.tensor, np.array):
        assert float(FOUR.distance(kind(one), kind(other))) == 0.5
        assert float(FOUR.distance(kind(one), kind(one))) == 0.0
        assert float(FOUR.distance(kind([1.0, 0, 0, 0]), kind([0, 0, 1.0, 0]))) == 1.0


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("arrows", FOUR.arrows[:3], "give an arrow and a colour to each of 4"),
        ("colors", FOUR.colors[:3], "give an arrow and a colour to each of 4"),
        ("order", (0, 1, 2, 2), "must name every action once"),
        ("opposite", (0, 1, 2, 2), "opposite"),
    ],
)
def test_a_set_that_contradicts_itself_is_refused(field, value, message):
    with pytest.raises(ValueError, match=message):
        Parts(**{**vars(FOUR), field: value})


@pytest.mark.parametrize("count", [3, 5])
def test_neither_fewer_nor_more_arrows_and_colours_than_parts(count):
    with pytest.raises(ValueError, match="give an arrow"):
        Parts(**{**vars(FOUR), "arrows": ((0, 0),) * count, "colors": ((0, 0, 0),) * count})


def test_what_is_undone_and_what_turns():
    every = torch.arange(4)
    assert FOUR.undoes(every, torch.tensor([1, 1, 3, 2])).tolist() == [True, False, True, True]
    assert FOUR.can_be_undone(every).all() and FOUR.turns(every).all()
    still = Parts(**{**vars(FOUR), "opposite": (0, 1, 2, 3), "mirrored": (1, 0, 2, 3)})
    assert not still.can_be_undone(every).any() and not still.undoes(every, every).any()
    assert still.turns(every).tolist() == [True, True, False, False]
