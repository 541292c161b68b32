import numpy as np
import pytest
import torch

from drone_rl.sim.parts import Parts

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
