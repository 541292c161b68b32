"""The rollout buffer returns recorded rows for any number of parts."""

import warnings

import pytest
import torch
import warp as wp
from tensordict import TensorDict

from drone_rl.acceleration.fused_collector import RolloutBuffer, is_free
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")


def make(num_rows=4):
    return RolloutBuffer(
        {"action": torch.zeros(num_rows, dtype=int), "pixels": torch.zeros(num_rows, 2)}
    )


def write(part_rows, *numbers):
    part_rows["action"][:] = torch.tensor(numbers)
    part_rows["pixels"][:] = torch.tensor(numbers)[:, None] * torch.tensor([1.0, 0.5])


def test_rows_are_read_in_any_order():
    buffer = make()
    for part in range(3):
        write(buffer.open(part, ("action", "pixels")), *(10 * part + row for row in range(4)))
    read = buffer.read(torch.tensor([9, 0, 3, 4]), ("action", "pixels"))
    assert read["action"].tolist() == [21, 0, 3, 10]
    assert read["pixels"].tolist() == [[n, n / 2] for n in (21, 0, 3, 10)]
    assert [*buffer.read(torch.tensor([11]), ["action"]).items()] == [
        ("action", torch.tensor([23]))
    ]


@pytest.mark.parametrize("num_parts", [1, 2, 3, 9])
def test_buffer_grows_with_the_number_of_parts(num_parts):
    buffer = make(3)
    where = []
    for _ in range(2):  # the second time without growing
        for part in range(num_parts):
            part_rows = buffer.open(part, ("action", "pixels"))
            write(part_rows, part, part + 100, part + 200)
        where.append(part_rows["pixels"].data_ptr())
        rows = torch.arange(3 * num_parts)
        expected = [part + hundreds for part in range(num_parts) for hundreds in (0, 100, 200)]
        assert buffer.read(rows, ["action"])["action"].tolist() == expected
    assert where[0] == where[1]


def test_unrecorded_entries_take_no_more_memory():
    buffer = make()
    for part in range(50):
        part_rows = buffer.open(part, ("action",))
        write(part_rows, *[part] * 4)
        assert part_rows["pixels"].data_ptr() == buffer.open(0, ())["pixels"].data_ptr()
    assert buffer.read(torch.arange(0, 200, 4), ["action"])["action"].tolist() == [*range(50)]
    assert buffer.open(0, ())["pixels"].untyped_storage().nbytes() == 4 * 2 * 4


def given(buffer, *numbers):
    write(buffer.open(0, ()), *numbers[:4])
    return buffer.read(torch.arange(len(numbers)) % 4, ["pixels"])["pixels"]


def test_memory_is_reused_once_released():
    buffer = make()
    first = given(buffer, 1, 2, 3, 4)
    where = first.data_ptr()
    del first
    again = given(buffer, 5, 6, 7, 8, 5)  # up to a quarter more fits
    assert again.data_ptr() == where and again[:, 0].tolist() == [5, 6, 7, 8, 5]
    del again
    with warnings.catch_warnings(action="error"):  # resizing by torch would warn
        assert given(buffer, 5, 6, 7, 8, 5, 6).shape == (6, 2)


def test_a_loop_that_holds_the_last_batch_alternates_between_two_memories():
    buffer, places, held = make(), [], None
    for i in range(6):
        held = given(buffer, i, i, i, i)  # the earlier one is released after this one is made
        places.append(held.data_ptr())
    assert len(set(places)) == 2 and places[0] == places[2] == places[4]
    wider = given(buffer, *range(9))  # neither fits: the one that is free is dropped
    assert wider.data_ptr() not in places and held[:, 0].tolist() == [5] * 4


@pytest.mark.parametrize(
    "hold",
    [
        lambda v: v,
        lambda v: v[2:],
        lambda v: v.detach(),
        lambda v: v.numpy(),
        lambda v: v[1].numpy(),
        lambda v: memoryview(v.numpy()),
        lambda v: TensorDict({"pixels": v}, [4]).reshape(-1).split(2)[1],
        lambda v: wp.from_torch(v),
        lambda v: torch.from_dlpack(v),
        lambda v: v.untyped_storage(),
    ],
)
def test_referenced_memory_is_not_overwritten(hold):
    buffer = make()
    first = given(buffer, 1, 2, 3, 4)
    where, held = first.data_ptr(), hold(first)
    del first
    second = given(buffer, 5, 6, 7, 8)
    assert second.data_ptr() != where and second[:, 0].tolist() == [5, 6, 7, 8]
    del held


def test_is_free_detects_other_references():
    tensor = torch.zeros(4)
    assert is_free(tensor) and is_free(tensor)
    view = tensor[1:]
    assert not is_free(tensor) and not is_free(view)
    del view
    assert is_free(tensor)
