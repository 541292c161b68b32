import threading

import pytest

from drone_rl.sim.rendering.devices import WorkerPool


def spans(crew, first, last):
    given = []
    crew.map_spans(first, last, lambda *span: given.append(span))
    return sorted(given)


@pytest.fixture
def crew():
    crew = WorkerPool(100, 3)
    yield crew
    crew.close()


def test_rows_are_shared_out_evenly_each_once(crew):
    assert spans(crew, 10, 17) == [(0, 10, 13), (1, 13, 16), (2, 16, 17)]


def test_fewer_rows_than_members_and_none(crew):
    assert spans(crew, 0, 2) == [(0, 0, 1), (1, 1, 2)]
    assert spans(crew, 5, 5) == []


def test_there_are_no_more_members_than_rows():
    assert WorkerPool(2, 8).size == 2
    assert WorkerPool(5, 1).size == 1


def test_members_work_at_the_same_time(crew):
    together = threading.Barrier(3, timeout=30)
    crew.map_spans(0, 3, lambda *_: together.wait())


def test_what_a_member_raises_reaches_the_caller(crew):
    def fail(member, first, last):
        if member == 2:
            raise KeyError(first)

    with pytest.raises(KeyError, match="2"):
        crew.map_spans(0, 3, fail)
