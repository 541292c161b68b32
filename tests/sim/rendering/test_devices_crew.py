import threading
import time

import pytest

from drone_rl.sim.rendering.devices import WorkerPool


def spans(pool, first, last):
    given = []
    pool.map_spans(first, last, lambda *span: given.append(span))
    return sorted(given)


@pytest.fixture
def pool():
    pool = WorkerPool(100, 3)
    yield pool
    pool.close()


def test_rows_are_split_evenly(pool):
    assert spans(pool, 10, 17) == [(0, 10, 13), (1, 13, 16), (2, 16, 17)]


def test_fewer_rows_than_workers(pool):
    assert spans(pool, 0, 2) == [(0, 0, 1), (1, 1, 2)]
    assert spans(pool, 5, 5) == []


def test_pool_has_no_more_workers_than_rows():
    assert WorkerPool(2, 8).size == 2
    assert WorkerPool(5, 1).size == 1


def test_workers_run_concurrently(pool):
    together = threading.Barrier(3, timeout=30)
    pool.map_spans(0, 3, lambda *_: together.wait())


def test_worker_exceptions_reach_the_caller(pool):
    def fail(worker, first, last):
        if worker == 2:
            raise KeyError(first)

    with pytest.raises(KeyError, match="2"):
        pool.map_spans(0, 3, fail)


def test_the_callers_own_error_is_raised_after_the_others_have_ended(pool):
    ended = []

    def fail_first(worker, first, last):
        if worker == 0:
            raise KeyError(first)
        time.sleep(0.05)
        ended.append(worker)

    with pytest.raises(KeyError, match="0"):
        pool.map_spans(0, 3, fail_first)
    assert sorted(ended) == [1, 2]
