"""Hand-written pickles equal torch's except for the intended defect."""

import pytest
import torch

from benchmarks import hostile_policies
from benchmarks.hostile_files import _about, weights
from drone_rl.utils.checkpoint import unpickle


def test_a_hand_written_checkpoint_is_valid():
    program = hostile_policies._state({"a": hostile_policies._tensor("Float", 4, (2, 2), (2, 1))})
    content = hostile_policies._archive(program, torch.arange(4.0).numpy().tobytes())
    state = unpickle(content, "x")
    assert state["format"] == "drone_rl checkpoint"
    assert state["policy"]["a"].tolist() == [[0.0, 1.0], [2.0, 3.0]]


@pytest.mark.parametrize("name", hostile_policies._storages())
def test_a_false_storage_is_refused(name):
    with pytest.raises(ValueError, match=r"."):
        unpickle(hostile_policies._storages()[name], "x")


def test_headers_differ():
    headers = hostile_policies._headers(weights(), _about())
    assert len({content[:5000] for content in headers.values()}) == len(headers) > 20
