"""What was written down is read as it was written, however many parts there are."""

import warnings

import pytest
import torch
import warp as wp
from tensordict import TensorDict

from drone_rl.acceleration.rollout_buffer import RolloutBuffer, is_free
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")


def make(num_rows=4):
    return RolloutBuffer(
        {"action": torch.zeros(num_rows, dtype=int), "pixels": torch.zeros(num_rows, 2)}
    )


def write(room, *numbers):
    room["action"][:] = torch.tensor(numbers)
    room["pixels"][:] = torch.tensor(numbers)[:, None] * torch.tensor([1.0, 0.5])


def test_rows_of_all_parts_in_any_order():
    book = make()
    for part in range(3):
        write(book.open(part, ("action", "pixels")), *(10 * part + row for row in range(4)))
    read = book.read(torch.tensor([9, 0, 3, 4]), ("action", "pixels"))
    assert read["action"].tolist() == [21, 0, 3, 10]
    assert read["pixels"].tolist() == [[n, n / 2] for n in (21, 0, 3, 10)]
    assert [*book.read(torch.tensor([11]), ["action"]).items()] == [("action", torch.tensor([23]))]


@pytest.mark.parametrize("num_parts", [1, 2, 3, 9])
def test_there_is_room_for_any_number_of_parts(num_parts):
    book = make(3)
    where = []
    for _ in range(2):  # and again in what has grown
        for part in range(num_parts):
            room = book.open(part, ("action", "pixels"))
            write(room, part, part + 100, part + 200)
        where.append(room["pixels"].data_ptr())
        rows = torch.arange(3 * num_parts)
        expected = [part + hundreds for part in range(num_parts) for hundreds in (0, 100, 200)]
        assert book.read(rows, ["action"])["action"].tolist() == expected
    assert where[0] == where[1]


def test_what_is_not_kept_takes_no_more_room():
    book = make()
    for part in range(50):
        room = book.open(part, ("action",))
        write(room, *[part] * 4)
        assert room["pixels"].data_ptr() == book.open(0, ())["pixels"].data_ptr()
    assert book.read(torch.arange(0, 200, 4), ["action"])["action"].tolist() == [*range(50)]
    assert book.open(0, ())["pixels"].untyped_storage().nbytes() == 4 * 2 * 4


def given(book, *numbers):
    write(book.open(0, ()), *numbers[:4])
    return book.read(torch.arange(len(numbers)) % 4, ["pixels"])["pixels"]


def test_memory_is_given_again_once_nobody_holds_it():
    book = make()
    first = given(book, 1, 2, 3, 4)
    where = first.data_ptr()
    del first
    again = given(book, 5, 6, 7, 8, 5)  # a quarter more fits
    assert again.data_ptr() == where and again[:, 0].tolist() == [5, 6, 7, 8, 5]
    del again
    with warnings.catch_warnings(action="error"):  # torch would widen it, and says so
        assert given(book, 5, 6, 7, 8, 5, 6).shape == (6, 2)


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
def test_what_anybody_holds_stays_as_it_was(hold):
    book = make()
    first = given(book, 1, 2, 3, 4)
    where, held = first.data_ptr(), hold(first)
    del first
    second = given(book, 5, 6, 7, 8)
    assert second.data_ptr() != where and second[:, 0].tolist() == [5, 6, 7, 8]
    del held


def test_free_is_what_one_alone_holds():
    tensor = torch.zeros(4)
    assert is_free(tensor) and is_free(tensor)
    view = tensor[1:]
    assert not is_free(tensor) and not is_free(view)
    del view
    assert is_free(tensor)
