import functools
import time
import types
from concurrent.futures import ThreadPoolExecutor
from threading import get_ident

import pytest
import torch

from drone_rl.sim.rendering import devices
from drone_rl.sim.rendering.devices import check_device, load_kernels
from drone_rl.utils.errors import InputError
from tests.forked import run_forked


@pytest.mark.parametrize("device", ["tpu", "cpu:0", "cuda:", "cuda:0x"])
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


def test_counting_gpus_does_not_print_the_version_of_warp(tmp_path):
    code = (
        "import torch; torch.cuda.is_available = lambda: True\n"
        "from drone_rl.sim.rendering.devices import check_device; check_device('cuda')"
    )
    done = run_forked(code, cwd=tmp_path)
    assert "initialized" not in done.stdout + done.stderr


def test_kernels_are_loaded_once_in_a_thread(monkeypatch):
    loaded = []
    monkeypatch.setattr(devices.wp, "load_module", lambda *_, **__: loaded.append(get_ident()))
    kernels = types.ModuleType("kernels")
    first = load_kernels(kernels)
    assert load_kernels(kernels) is first
    assert first.result() is None
    assert len(loaded) == 1
    assert loaded[0] != get_ident()


def test_compiler_errors_reach_the_caller(monkeypatch):
    def refuse(*_, **__):
        raise RuntimeError("no such kernel")

    monkeypatch.setattr(devices.wp, "load_module", refuse)
    with pytest.raises(RuntimeError, match="no such kernel"):
        load_kernels(types.ModuleType("kernels")).result()


def test_forked_process_reloads_kernels(monkeypatch):
    monkeypatch.setattr(devices.wp, "load_module", lambda *_, **__: None)
    kernels = types.ModuleType("kernels")
    here = load_kernels(kernels)
    monkeypatch.setattr(devices.os, "getpid", lambda: -1)  # as in a fork
    assert load_kernels(kernels) is not here


def test_concurrent_requests_load_once(monkeypatch):
    loaded = []
    monkeypatch.setattr(devices.wp, "load_module", lambda *_, **__: loaded.append(get_ident()))
    begin = devices._load_kernels.__wrapped__
    slow = functools.cache(lambda *key: time.sleep(0.05) or begin(*key))
    monkeypatch.setattr(devices, "_load_kernels", slow)
    kernels = types.ModuleType("kernels")
    with ThreadPoolExecutor(4) as pool:
        futures = [f.result() for f in [pool.submit(load_kernels, kernels) for _ in range(4)]]
    assert len({id(future) for future in futures}) == 1
    assert futures[0].result() is None and len(loaded) == 1


def test_warp_reports_only_errors_on_cpu():
    devices.start_warp("cpu")
    assert devices.wp.config.log_level >= devices.wp.LOG_ERROR


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
