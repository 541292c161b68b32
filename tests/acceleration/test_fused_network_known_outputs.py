"""Outputs are known of these very pictures, by these weights, until they are written over."""

import pytest
import torch

from drone_rl.acceleration.fused_network import ActivationCache

WEIGHTS = torch.tensor([1.0, -2.0])


def noted(pictures):
    known = ActivationCache(8, 3)
    known.forget()
    known.note(pictures, torch.tensor([6, 0, 1, 7]), WEIGHTS)
    return known


def test_all_of_them_and_some():
    pictures = torch.rand(4, 1, 2, 5)
    known = noted(pictures)
    assert known.outputs.shape == (8, 3)
    assert known.find(pictures.flatten(1), WEIGHTS.clone()).tolist() == [6, 0, 1, 7]
    assert known.find(pictures[1:3].reshape(-1, 10), WEIGHTS).tolist() == [0, 1]
    assert known.find(pictures.detach()[3:].flatten(1), WEIGHTS).tolist() == [7]
    assert known.find(pictures.flatten(1), WEIGHTS).dtype == torch.int32


def test_where_the_pictures_are_a_part_of_something_else():
    pictures = torch.rand(9, 10)[2:6]
    known = noted(pictures)
    assert known.find(pictures[2:], WEIGHTS).tolist() == [1, 7]


@pytest.mark.parametrize(
    "other",
    [
        lambda p: p.clone(),
        lambda p: p[::2],
        lambda p: p[:, :5],
        lambda p: p.flatten()[5:25].view(2, 10),  # begins within a picture
        lambda p: p.flatten().view(8, 5),
        lambda p: p.view(10, 4).T,
        lambda p: p.mul_(1.0),
        lambda p: p[0].zero_() * p[:1] + p[:1],
    ],
)
def test_not_of_other_numbers(other):
    pictures = torch.rand(4, 10)
    known = noted(pictures)
    assert known.find(pictures, WEIGHTS) is not None
    assert known.find(other(pictures), WEIGHTS) is None


def test_not_of_pictures_that_were_changed_in_place_even_if_only_one_was():
    pictures = torch.rand(4, 10)
    known = noted(pictures)
    pictures[3, 3] += 1.0
    assert known.find(pictures[:2], WEIGHTS) is None


def test_not_by_other_weights():
    pictures = torch.rand(4, 10)
    known = noted(pictures)
    assert known.find(pictures, torch.tensor([1.0, -2.0000002])) is None


def test_not_once_they_are_forgotten():
    pictures = torch.rand(4, 10)
    known = noted(pictures)
    assert known.times == 1
    known.forget()
    assert known.find(pictures, WEIGHTS) is None and known.times == 2


def test_nothing_is_known_where_there_was_no_room_for_all():
    pictures = torch.rand(2, 10)
    for last, is_known in ((7, True), (8, False)):
        known = ActivationCache(8, 3)
        known.note(pictures, torch.tensor([0, last]), WEIGHTS)
        assert (known.find(pictures, WEIGHTS) is not None) is is_known


def test_nothing_is_known_at_first_and_of_what_has_no_history():
    pictures = torch.rand(4, 10)
    assert ActivationCache(8, 3).find(pictures, WEIGHTS) is None
    assert ActivationCache(8, 3).find(torch.empty(0, 10), torch.empty(0)) is None
    with torch.inference_mode():
        assert noted(pictures).find(torch.rand(4, 10), WEIGHTS) is None
