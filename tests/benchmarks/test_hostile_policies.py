"""Instructions written by hand do what torch's do, and lie only where they are told to."""

import pytest
import torch

from benchmarks import hostile_policies as made
from benchmarks.hostile_files import _about, weights
from drone_rl.utils.checkpoint import unpickle


def test_what_the_lies_are_made_from_is_true():
    program = made._state({"a": made._tensor("Float", 4, (2, 2), (2, 1))})
    content = made._archive(program, torch.arange(4.0).numpy().tobytes())
    state = unpickle(content, "x")
    assert state["format"] == "drone_rl checkpoint"
    assert state["policy"]["a"].tolist() == [[0.0, 1.0], [2.0, 3.0]]


@pytest.mark.parametrize("name", made._storages())
def test_no_storage_is_believed(name):
    with pytest.raises(ValueError, match=r"."):
        unpickle(made._storages()[name], "x")


def test_each_header_is_another_one():
    headers = made._headers(weights(), _about())
    assert len({content[:5000] for content in headers.values()}) == len(headers) > 20
