import dataclasses

import pytest
import torch
from torch import Tensor

from drone_rl.utils.batch import Batch


@dataclasses.dataclass
class Inner(Batch):
    x: Tensor


@dataclasses.dataclass
class Outer(Batch):
    inner: Inner
    y: Tensor


@pytest.fixture
def batch():
    return Outer(Inner(torch.arange(8.0).view(4, 2)), torch.arange(4))


def test_some_worlds_are_a_copy_and_those_of_a_slice_a_view(batch):
    chosen = batch[torch.tensor([3, 1])]
    assert chosen.y.tolist() == [3, 1] and chosen.inner.x.tolist() == [[6, 7], [2, 3]]
    chosen.inner.x.zero_()
    assert batch.inner.x.sum() == 28
    batch[1:3].inner.x.zero_()
    assert batch.inner.x[:, 0].tolist() == [0, 0, 0, 6]
    assert len(batch) == 4 and len(batch[1:3]) == 2


def test_overwritten_worlds_are_overwritten_all_through(batch):
    other = Outer(Inner(-torch.ones(1, 2)), torch.tensor([9]))
    batch[torch.tensor([2])] = other
    assert batch.y.tolist() == [0, 1, 9, 3]
    assert batch.inner.x[2].tolist() == [-1, -1] and batch.inner.x[3].tolist() == [6, 7]


def test_parts_follow_one_another_and_the_last_may_be_smaller(batch):
    parts = batch.split(3)
    assert [part.y.tolist() for part in parts] == [[0, 1, 2], [3]]
    assert parts[1].inner.x.tolist() == [[6, 7]]


def test_everything_goes_to_the_device(batch):
    moved = batch.to("meta")
    assert moved.y.is_meta and moved.inner.x.is_meta and not batch.y.is_meta


def test_as_plain_tensors_and_back(batch):
    told = batch.tensors()
    assert told["inner"]["x"] is batch.inner.x and set(told) == {"inner", "y"}
    again = Outer(Inner(torch.zeros(4, 2)), torch.zeros(4).long()).with_tensors(told)
    assert torch.equal(again.inner.x, batch.inner.x) and torch.equal(again.y, batch.y)
    again.inner.x.zero_()
    assert batch.inner.x.sum() == 28  # it has tensors of its own
