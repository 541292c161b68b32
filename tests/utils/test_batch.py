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


def test_indices_copy_and_slices_view(batch):
    chosen = batch[torch.tensor([3, 1])]
    assert chosen.y.tolist() == [3, 1] and chosen.inner.x.tolist() == [[6, 7], [2, 3]]
    chosen.inner.x.zero_()
    assert batch.inner.x.sum() == 28
    batch[1:3].inner.x.zero_()
    assert batch.inner.x[:, 0].tolist() == [0, 0, 0, 6]
    assert len(batch) == 4 and len(batch[1:3]) == 2


def test_assignment(batch):
    other = Outer(Inner(-torch.ones(1, 2)), torch.tensor([9]))
    batch[torch.tensor([2])] = other
    assert batch.y.tolist() == [0, 1, 9, 3]
    assert batch.inner.x[2].tolist() == [-1, -1] and batch.inner.x[3].tolist() == [6, 7]


def test_split(batch):
    parts = batch.split(3)
    assert [part.y.tolist() for part in parts] == [[0, 1, 2], [3]]
    assert parts[1].inner.x.tolist() == [[6, 7]]


def test_to_device(batch):
    moved = batch.to("meta")
    assert moved.y.is_meta and moved.inner.x.is_meta and not batch.y.is_meta


def test_tensors_round_trip(batch):
    told = batch.tensors()
    assert told["inner"]["x"] is batch.inner.x and set(told) == {"inner", "y"}
    again = Outer(Inner(torch.zeros(4, 2)), torch.zeros(4).long()).with_tensors(told)
    assert torch.equal(again.inner.x, batch.inner.x) and torch.equal(again.y, batch.y)
    again.inner.x.zero_()
    assert batch.inner.x.sum() == 28  # it has tensors of its own
