"""What was taken down in parts is given episode after episode."""

import pytest
import torch

from drone_rl.collectors.logbook import Logbook


def logged(*numbers):
    numbers = torch.tensor(numbers)
    return {"action": numbers, "pixels": numbers[:, None] * torch.tensor([1.0, 0.5])}


def test_episodes_follow_each_other_and_steps_keep_their_order():
    book = Logbook()
    book.begin()
    book.add(torch.tensor([0, 0, 1]), torch.tensor([0, 1, 3]), logged(10, 11, 99, 20))
    book.add(torch.tensor([0, 1, 1]), torch.tensor([2, 0, 1]), logged(21, 22, 12))
    assert len(book) == 6
    worlds, taken = book.take()
    assert worlds.tolist() == [0, 0, 0, 1, 1, 1]
    assert taken["action"].tolist() == [10, 11, 12, 20, 21, 22]
    assert taken["pixels"].tolist() == [[n, n / 2] for n in (10, 11, 12, 20, 21, 22)]


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_there_is_room_for_any_number_of_parts(count):
    book = Logbook()
    book.begin()
    for part in range(9):
        rows = torch.arange(count)
        book.add(torch.full([count], 9 - part), rows, {"reward": rows + 100 * part})
    worlds, taken = book.take()
    assert worlds.tolist() == [world for world in range(1, 10) for _ in range(count)]
    expected = [100 * part + row for part in range(8, -1, -1) for row in range(count)]
    assert taken["reward"].tolist() == expected


def test_what_was_given_stays_when_the_memory_is_used_again():
    book = Logbook()
    given = []
    for number in (1, 2):
        book.begin()
        book.add(torch.tensor([0]), torch.tensor([0]), logged(number))
        given.append(book.take()[1]["action"])
    assert [values.tolist() for values in given] == [[1], [2]]


def test_an_interrupted_flight_leaves_nothing_behind():
    book = Logbook()
    book.begin()
    book.add(torch.tensor([0, 0]), torch.tensor([0, 1]), logged(1, 2))
    book.begin()
    assert not len(book)
    book.add(torch.tensor([0]), torch.tensor([0]), {"action": torch.tensor([3])})
    worlds, taken = book.take()
    assert worlds.tolist() == [0] and {n: v.tolist() for n, v in taken.items()} == {"action": [3]}
