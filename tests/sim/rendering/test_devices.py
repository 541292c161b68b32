"""Devices, the start of Warp, loading of kernels, and worker threads."""

import time
import types

import pytest
import torch

from drone_rl.sim.rendering import devices
from drone_rl.sim.rendering.devices import WorkerPool, check_device, load_kernels
from drone_rl.utils.errors import InputError
from tests.forked import run_forked


@pytest.mark.parametrize("device", ["tpu", "cuda:0x"])
def test_unknown_device_raises(device):
    with pytest.raises(InputError, match=f"device={device} is unknown; give cpu, cuda or cuda:N"):
        check_device(device)


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_cuda_without_gpu_raises():
    with pytest.raises(InputError, match="give device=cpu"):
        check_device("cuda")


def test_warp_starts_without_output(tmp_path):
    code = "from drone_rl.sim.rendering.devices import start_warp; start_warp('cpu')"
    done = run_forked(code, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_forked_process_reloads_kernels(monkeypatch):
    monkeypatch.setattr(devices.wp, "load_module", lambda *_, **__: None)
    kernels = types.ModuleType("kernels")
    here = load_kernels(kernels)
    monkeypatch.setattr(devices.os, "getpid", lambda: -1)  # as in a fork
    assert load_kernels(kernels) is not here


@pytest.mark.parametrize(
    ("device", "message"),
    [
        ("cuda:2", "of usable CUDA GPUs is 2; give cuda:N with N of at most 1"),
        ("cuda:x", "unknown"),
    ],
)
def test_gpus_that_do_not_exist_are_refused(device, message, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(devices.wp, "get_cuda_device_count", lambda: 2)
    check_device("cuda:1")
    with pytest.raises(InputError, match=message):
        check_device(device)


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
